#include <functional>

#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "base/task_pool.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

/// How much of each of its vectors a result has.
using Mark = std::array<std::size_t, 3>;

template <typename T>
void appendPart(const std::vector<T>& from, std::size_t begin, std::size_t end,
                std::vector<T>& to) {
  begin = std::min(begin, from.size());  // of a vector that was not asked for
  end = std::min(end, from.size());
  to.insert(to.end(), from.begin() + std::ptrdiff_t(begin), from.begin() + std::ptrdiff_t(end));
}

template <typename S>
using Contacts = std::vector<fcl::Contact<S>>;
template <typename S>
Mark endOf(const Contacts<S>& contacts) {
  return {contacts.size(), 0, 0};
}
template <typename S>
void append(const Contacts<S>& from, const Mark& begin, const Mark& end, Contacts<S>& to) {
  appendPart(from, begin[0], end[0], to);
}

template <typename S>
Mark endOf(const TrianglePairs<S>& pairs) {
  return {pairs.size(), 0, 0};
}
template <typename S>
void append(const TrianglePairs<S>& from, const Mark& begin, const Mark& end,
            TrianglePairs<S>& to) {
  appendPart(from.triangles, begin[0], end[0], to.triangles);
  appendPart(from.distances, begin[0], end[0], to.distances);
  appendPart(from.nearest_points, begin[0], end[0], to.nearest_points);
}

Mark endOf(const FeaturePairs& pairs) {
  return {pairs.vertex_face.size(), pairs.face_vertex.size(), pairs.edge_edge.size()};
}
void append(const FeaturePairs& from, const Mark& begin, const Mark& end, FeaturePairs& to) {
  appendPart(from.vertex_face, begin[0], end[0], to.vertex_face);
  appendPart(from.face_vertex, begin[1], end[1], to.face_vertex);
  appendPart(from.edge_edge, begin[2], end[2], to.edge_edge);
}

template <typename S>
Mark endOf(const VertexContacts<S>& contacts) {
  return {contacts.size(), 0, 0};
}
template <typename S>
void append(const VertexContacts<S>& from, const Mark& begin, const Mark& end,
            VertexContacts<S>& to) {
  appendPart(from.vertices, begin[0], end[0], to.vertices);
  appendPart(from.distances, begin[0], end[0], to.distances);
  appendPart(from.positions, begin[0], end[0], to.positions);
  appendPart(from.nearest_points, begin[0], end[0], to.nearest_points);
  appendPart(from.normals, begin[0], end[0], to.normals);
  appendPart(from.triangles, begin[0], end[0], to.triangles);
  appendPart(from.barycentric, begin[0], end[0], to.barycentric);
  appendPart(from.areas, begin[0], end[0], to.areas);
}

/// What a pair found: some of what its thread found.
struct Found {
  std::size_t slot;
  Mark begin, end;
  bool counts;
};

/// Calls query(pair, found) for all pairs, on all threads; it appends to `found` and returns
/// whether the pair counts. Then take(pair, mark) for each that does, in order, when `found` has
/// all that was found for the pairs before and for this one, up to `mark`.
template <typename Data, typename Query, typename Take>
void queryPairs(int threads, const std::vector<BodyPair>& pairs, const Query& query, Data& found,
                const Take& take) {
  const TaskPool pool(pairs.size() > 1 ? threads : 1);
  if (pool.size() == 1) {
    for (const BodyPair& pair : pairs)
      if (query(pair, found)) take(pair, endOf(found));
    return;
  }
  static thread_local std::vector<Data> memory;
  static thread_local std::vector<Found> parts;
  std::vector<Data>& of_slot = memory;
  std::vector<Found>& of_pair = parts;  // those of this thread, for all
  of_slot.resize(std::max(of_slot.size(), std::size_t(pool.size())));
  for (Data& data : of_slot) data.clear();
  of_pair.resize(pairs.size());
  pool.forEach(static_cast<int>(pairs.size()), [&](int task, int slot) {
    const auto at = static_cast<std::size_t>(task);
    Data& data = of_slot[static_cast<std::size_t>(slot)];
    Found& part = of_pair[at];
    part.slot = static_cast<std::size_t>(slot);
    part.begin = endOf(data);
    part.counts = query(pairs[at], data);
    part.end = endOf(data);
  });
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Found& part = of_pair[i];
    if (!part.counts) continue;
    append(of_slot[part.slot], part.begin, part.end, found);
    take(pairs[i], endOf(found));
  }
}

/// This thread's; what a query found before is gone.
template <typename Data>
Data& scratch() {
  static thread_local Data data;
  data.clear();
  return data;
}

/// The pairs of a query, by places in `bodies`.
std::vector<BodyPair>& pairsOfThisThread() {
  static thread_local std::vector<BodyPair> pairs;
  return pairs;
}

template <typename S>
bool isSelf(const BodyPair& pair) {
  return pair.first == pair.second;
}

/// Adds each body that is to be tested against itself, where `pairs` are sorted.
template <typename S>
void addSelves(const std::vector<Body<S>>& bodies, std::vector<BodyPair>& pairs) {
  const std::size_t before = pairs.size();
  for (unsigned i = 0; i < bodies.size(); ++i)
    if (bodies[i].options.self_collision) pairs.push_back({i, i});
  std::inplace_merge(pairs.begin(), pairs.begin() + std::ptrdiff_t(before), pairs.end());
}

/// A contact whose objects are those of the pair, in its order.
template <typename S>
fcl::Contact<S> inOrder(fcl::Contact<S> contact, const fcl::CollisionGeometry<S>* first) {
  if (contact.o1 == first) return contact;
  std::swap(contact.o1, contact.o2);
  std::swap(contact.b1, contact.b2);
  contact.normal = -contact.normal;
  return contact;
}

/// Whether two bodies touch, with their contacts; or one itself.
template <typename S>
bool collidePair(const Body<S>& a, const Body<S>& b, const SceneCollisionRequest& request,
                 Contacts<S>& found) {
  const fcl::CollisionRequest<S> asked(std::max<std::size_t>(1, request.contacts_per_pair),
                                       request.enable_contact && request.contacts_per_pair > 0);
  fcl::CollisionResult<S>& result = scratch<fcl::CollisionResult<S>>();
  if (&a == &b)
    selfCollide(*a.mesh, a.tf, asked, result);
  else
    adaptive_bvh::collide<S>(a.geometry, a.tf, b.geometry, b.tf, asked, result);
  for (std::size_t i = 0; i < result.numContacts() && i < request.contacts_per_pair; ++i)
    found.push_back(inOrder(result.getContact(i), a.geometry));
  return result.isCollision();
}

}  // namespace

template <typename S>
std::size_t Scene<S>::collisions(const SceneCollisionRequest& request,
                                 SceneCollisions<S>& result) const {
  const State& state = *state_;
  state.requireCurrent();
  std::vector<BodyPair>& pairs = pairsOfThisThread();
  state.findPairs(0, pairs);
  addSelves(state.bodies, pairs);
  result.pairs.clear();
  result.contacts.clear();
  result.offsets.assign(1, 0);
  const auto test = [&](const BodyPair& pair, Contacts<S>& found) {
    return collidePair(state.bodies[pair.first], state.bodies[pair.second], request, found);
  };
  const auto take = [&](const BodyPair& pair, const Mark& mark) {
    result.pairs.push_back({state.bodies[pair.first].id, state.bodies[pair.second].id});
    result.offsets.push_back(mark[0]);
  };
  if (!request.first_only) {
    queryPairs(state.threads, pairs, test, result.contacts, take);
    return result.pairs.size();
  }
  for (const BodyPair& pair : pairs) {
    if (!test(pair, result.contacts)) continue;
    take(pair, endOf<S>(result.contacts));
    break;
  }
  return result.pairs.size();
}

template <typename S>
std::size_t Scene<S>::pairsWithin(const ProximityRequest<S>& request,
                                  SceneTrianglePairs<S>& result) const {
  const State& state = *state_;
  requireDistance(request.distance);
  state.requireCurrent();
  std::vector<BodyPair>& pairs = pairsOfThisThread();
  state.findPairs(double(request.distance), pairs);
  addSelves(state.bodies, pairs);
  result.pairs.clear();
  result.found.clear();
  result.offsets.assign(1, 0);
  queryPairs(
      state.threads, pairs,
      [&](const BodyPair& pair, TrianglePairs<S>& found) {
        const Body<S>&a = state.bodies[pair.first], &b = state.bodies[pair.second];
        if (!a.mesh || !b.mesh) return false;
        TrianglePairs<S>& near = scratch<TrianglePairs<S>>();
        if (&a == &b)
          adaptive_bvh::pairsWithin(*a.mesh, request, near);
        else
          adaptive_bvh::pairsWithin(*a.mesh, a.tf, *b.mesh, b.tf, request, near);
        if (&a == &b)
          for (auto& points : near.nearest_points)
            for (fcl::Vector3<S>& x : points) x = a.tf * x;
        append(near, {}, endOf(near), found);
        return near.size() > 0;
      },
      result.found,
      [&](const BodyPair& pair, const Mark& mark) {
        result.pairs.push_back({state.bodies[pair.first].id, state.bodies[pair.second].id});
        result.offsets.push_back(mark[0]);
      });
  return result.found.size();
}

template <typename S>
std::size_t Scene<S>::featurePairsWithin(S distance, SceneFeaturePairs& result) const {
  const State& state = *state_;
  requireDistance(distance);
  state.requireCurrent();
  std::vector<BodyPair>& pairs = pairsOfThisThread();
  state.findPairs(double(distance), pairs);
  addSelves(state.bodies, pairs);
  result.pairs.clear();
  result.found.clear();
  result.offsets.assign(1, {});
  queryPairs(
      state.threads, pairs,
      [&](const BodyPair& pair, FeaturePairs& found) {
        const Body<S>&a = state.bodies[pair.first], &b = state.bodies[pair.second];
        if (!a.mesh || !b.mesh) return false;
        FeaturePairs& near = scratch<FeaturePairs>();
        if (&a == &b)
          adaptive_bvh::featurePairsWithin(*a.mesh, distance, near);
        else
          adaptive_bvh::featurePairsWithin(*a.mesh, a.tf, *b.mesh, b.tf, distance, near);
        append(near, {}, endOf(near), found);
        return near.size() > 0;
      },
      result.found,
      [&](const BodyPair& pair, const Mark& mark) {
        result.pairs.push_back({state.bodies[pair.first].id, state.bodies[pair.second].id});
        result.offsets.push_back(mark);
      });
  return result.found.size();
}

template <typename S>
std::size_t Scene<S>::vertexContacts(S margin, SceneVertexContacts<S>& result) const {
  const State& state = *state_;
  requireDistance(margin);
  state.requireCurrent();
  std::vector<BodyPair>& pairs = pairsOfThisThread();
  state.findPairs(double(margin), pairs);
  for (std::size_t i = 0, count = pairs.size(); i < count; ++i)
    pairs.push_back({pairs[i].second, pairs[i].first});
  const auto isAnswered = [&](const BodyPair& pair) {
    const Body<S>&mesh = state.bodies[pair.first], &other = state.bodies[pair.second];
    if (!mesh.mesh) return false;
    if (other.mesh) return stateOf(*other.mesh).topology->owners.isClosed();
    return other.geometry->getNodeType() != fcl::GEOM_OCTREE;
  };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), std::not_fn(isAnswered)), pairs.end());
  std::sort(pairs.begin(), pairs.end());
  result.pairs.clear();
  result.found.clear();
  result.offsets.assign(1, 0);
  queryPairs(
      state.threads, pairs,
      [&](const BodyPair& pair, VertexContacts<S>& found) {
        const Body<S>&mesh = state.bodies[pair.first], &other = state.bodies[pair.second];
        VertexContacts<S>& near = scratch<VertexContacts<S>>();
        adaptive_bvh::vertexContacts(*mesh.mesh, mesh.tf, *other.geometry, other.tf, margin, near);
        append(near, {}, endOf(near), found);
        return near.size() > 0;
      },
      result.found,
      [&](const BodyPair& pair, const Mark& mark) {
        result.pairs.push_back({state.bodies[pair.first].id, state.bodies[pair.second].id});
        result.offsets.push_back(mark[0]);
      });
  return result.found.size();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template std::size_t Scene<S>::collisions(const SceneCollisionRequest&, SceneCollisions<S>&)   \
      const;                                                                                     \
  template std::size_t Scene<S>::pairsWithin(const ProximityRequest<S>&, SceneTrianglePairs<S>&) \
      const;                                                                                     \
  template std::size_t Scene<S>::featurePairsWithin(S, SceneFeaturePairs&) const;                \
  template std::size_t Scene<S>::vertexContacts(S, SceneVertexContacts<S>&) const;
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
