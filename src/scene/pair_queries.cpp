#include <array>
#include <tuple>
#include <utility>

#include "adaptive_bvh/self_collision.h"
#include "base/leased.h"
#include "base/task_pool.h"
#include "dispatch/contained.h"
#include "dispatch/pairs.h"
#include "query/single_precision.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

template <typename S>
using Contacts = std::vector<fcl::Contact<S>>;

// The vectors of a result. Vectors that were not requested are empty.
template <typename S>
auto vectorsOf(Contacts<S>& contacts) {
  return std::tie(contacts);
}
template <typename S>
auto vectorsOf(TrianglePairs<S>& pairs) {
  return std::tie(pairs.triangles, pairs.distances, pairs.nearest_points);
}
auto vectorsOf(FeaturePairs& pairs) {
  return std::tie(pairs.vertex_face, pairs.face_vertex, pairs.edge_edge);
}
template <typename S>
auto vectorsOf(VertexContacts<S>& c) {
  return std::tie(c.vertices, c.distances, c.positions, c.nearest_points, c.normals, c.triangles,
                  c.barycentric, c.areas);
}

/// How much each of a result's vectors holds.
using Mark = std::array<std::size_t, 8>;

template <typename Data>
Mark endOf(Data& data) {
  Mark mark{};
  std::size_t i = 0;
  std::apply([&](auto&... vectors) { ((mark[i++] = vectors.size()), ...); }, vectorsOf(data));
  return mark;
}

/// Adds what `from` holds from one mark to the other.
template <typename Data, std::size_t... I>
void append(Data& from, const Mark& begin, const Mark& end, Data& to, std::index_sequence<I...>) {
  const auto sources = vectorsOf(from), targets = vectorsOf(to);
  const auto at = [](auto& vector, std::size_t i) { return vector.begin() + std::ptrdiff_t(i); };
  (std::get<I>(targets).insert(std::get<I>(targets).end(), at(std::get<I>(sources), begin[I]),
                               at(std::get<I>(sources), end[I])),
   ...);
}
template <typename Data>
void append(Data& from, const Mark& begin, const Mark& end, Data& to) {
  constexpr std::size_t kVectors = std::tuple_size<decltype(vectorsOf(from))>::value;
  append(from, begin, end, to, std::make_index_sequence<kVectors>());
}

/// What a pair found: some of what its thread found.
struct Found {
  std::size_t slot;
  Mark begin, end;
  bool counts;
};

/// Calls query(pair, found) for all pairs, on all threads; it appends to `found` and returns
/// whether the pair counts. Then take(pair, mark) for each that does, in order, when `found` has
/// all that was found for the pairs before and for this one, up to `mark`; it returns whether to go
/// on.
template <typename Data, typename Query, typename Take>
void queryPairs(int threads, const std::vector<BodyPair>& pairs, const Query& query, Data& found,
                const Take& take) {
  const TaskPool pool(pairs.size() > 1 ? threads : 1);
  if (pool.size() == 1) {
    for (const BodyPair& pair : pairs)
      if (query(pair, found) && !take(pair, endOf(found))) return;
    return;
  }
  const Leased<std::vector<Data>> memory;
  const Leased<std::vector<Found>> parts;
  std::vector<Data>& of_slot = *memory;
  std::vector<Found>& of_pair = *parts;
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
    if (!take(pairs[i], endOf(found))) return;
  }
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

/// Two bodies of a query and the objects that its contacts name, in the order of contacts.
struct PairOfObjects {
  const QueryObject &first, &second;
  const fcl::CollisionGeometryd &o1, &o2;
};

/// Adds the contacts of a body inside of a solid one, whose surfaces do not touch.
void addInside(const PairOfObjects& of, bool is_first_solid, bool is_second_solid,
               const CollisionQuery<double>& query) {
  if (is_second_solid && of.first.kind() == ObjectKind::Mesh && !query.isSatisfied())
    addContained(of.first.mesh(), of.second.mesh(), false, of.o1, of.o2, query);
  if (!is_first_solid || query.isSatisfied()) return;
  if (of.second.kind() == ObjectKind::Mesh)
    addContained(of.second.mesh(), of.first.mesh(), true, of.o1, of.o2, query);
  if (of.second.kind() == ObjectKind::Shape)
    addContained(of.second.solid(), of.first.mesh(), of.o1, of.o2, query);
}

/// Adds the contacts of two bodies.
template <typename S>
void collideBodies(const Body<S>& a, const Body<S>& b, const CollisionQuery<S>& query) {
  const QueryObject first(objectOf(a)), second(objectOf(b));
  const PairSearch& pair = searchOf(first.kind(), second.kind());
  if (pair.is_swapped) return collideBodies(b, a, query);
  answerInDouble(
      query, a.geometry, b.geometry,
      [&](const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
          const CollisionQuery<double>& in_double) {
        pair.collide(first, second, o1, o2, in_double);
        if (!in_double.result.isCollision())
          addInside({first, second, o1, o2}, a.options.solid, b.options.solid, in_double);
      });
}

/// Whether two bodies touch, with their contacts; or one itself.
template <typename S>
bool collidePair(const Body<S>& a, const Body<S>& b, const SceneCollisionRequest& request,
                 Contacts<S>& found) {
  const fcl::CollisionRequest<S> asked(std::max<std::size_t>(1, request.contacts_per_pair),
                                       request.enable_contact && request.contacts_per_pair > 0);
  const Leased<fcl::CollisionResult<S>> leased;
  fcl::CollisionResult<S>& result = *leased;
  result.clear();
  if (&a == &b) {
    selfCollide(*a.mesh, a.tf, asked, result);
  } else {
    collideBodies<S>(a, b, {asked, result});
    if (!asked.enable_contact) unsetFields(result, 0);
  }
  for (std::size_t i = 0; i < result.numContacts() && i < request.contacts_per_pair; ++i)
    found.push_back(inOrder(result.getContact(i), a.geometry));
  return result.isCollision();
}

std::size_t offsetOf(const Mark& mark, const std::size_t*) { return mark[0]; }
std::array<std::size_t, 3> offsetOf(const Mark& mark, const std::array<std::size_t, 3>*) {
  return {mark[0], mark[1], mark[2]};
}

/// Overwrites a result, of which `found` is a part, by what query(first, second, found) finds for
/// pairs of bodies, as queryPairs; up to the first pair that counts on request.
template <typename S, typename Query, typename Result, typename Data>
void collect(const std::vector<Body<S>>& bodies, int threads, const std::vector<BodyPair>& pairs,
             const Query& query, Result& result, Data& found, bool first_only = false) {
  using Offset = typename decltype(result.offsets)::value_type;
  result.pairs.clear();
  result.offsets.assign(1, Offset());
  found.clear();
  queryPairs(
      first_only ? 1 : threads, pairs,
      [&](const BodyPair& pair, Data& of_pair) {
        return query(bodies[pair.first], bodies[pair.second], of_pair);
      },
      found,
      [&](const BodyPair& pair, const Mark& mark) {
        result.pairs.push_back({bodies[pair.first].id, bodies[pair.second].id});
        result.offsets.push_back(offsetOf(mark, static_cast<const Offset*>(nullptr)));
        return !first_only;
      });
}

/// Collects results of a query(first, second, near) that overwrites `near`, all of which counts.
template <typename S, typename Query, typename Result>
std::size_t collectFound(const std::vector<Body<S>>& bodies, int threads,
                         const std::vector<BodyPair>& pairs, const Query& query, Result& result) {
  using Data = decltype(result.found);
  collect(
      bodies, threads, pairs,
      [&](const Body<S>& a, const Body<S>& b, Data& found) {
        const Leased<Data> near;
        near->clear();
        query(a, b, *near);
        append(*near, {}, endOf(*near), found);
        return near->size() > 0;
      },
      result, result.found);
  return result.found.size();
}

}  // namespace

template <typename S>
std::size_t Scene<S>::collisions(const SceneCollisionRequest& request,
                                 SceneCollisions<S>& result) const {
  const State& state = *state_;
  state.requireCurrent();
  const Leased<std::vector<BodyPair>> leased;
  std::vector<BodyPair>& pairs = *leased;
  state.findPairs(0, 0, pairs);
  addSelves(state.bodies, pairs);
  collect(
      state.bodies, state.threads, pairs,
      [&](const Body<S>& a, const Body<S>& b, Contacts<S>& found) {
        return collidePair(a, b, request, found);
      },
      result, result.contacts, request.first_only);
  return result.pairs.size();
}

template <typename S>
std::size_t Scene<S>::pairsWithin(const ProximityRequest<S>& request,
                                  SceneTrianglePairs<S>& result) const {
  const State& state = *state_;
  requireDistance(request.distance);
  state.requireCurrent();
  const Leased<std::vector<BodyPair>> leased;
  std::vector<BodyPair>& pairs = *leased;
  state.findPairs(double(request.distance), 2, pairs);
  addSelves(state.bodies, pairs);
  const auto query = [&](const Body<S>& a, const Body<S>& b, TrianglePairs<S>& near) {
    if (&a != &b) {
      adaptive_bvh::pairsWithin(*a.mesh, a.tf, *b.mesh, b.tf, request, near);
      return;
    }
    adaptive_bvh::pairsWithin(*a.mesh, request, near);
    for (auto& points : near.nearest_points)
      for (fcl::Vector3<S>& x : points) x = a.tf * x;
  };
  return collectFound(state.bodies, state.threads, pairs, query, result);
}

template <typename S>
std::size_t Scene<S>::featurePairsWithin(S distance, SceneFeaturePairs& result) const {
  const State& state = *state_;
  requireDistance(distance);
  state.requireCurrent();
  const Leased<std::vector<BodyPair>> leased;
  std::vector<BodyPair>& pairs = *leased;
  state.findPairs(double(distance), 2, pairs);
  addSelves(state.bodies, pairs);
  const auto query = [&](const Body<S>& a, const Body<S>& b, FeaturePairs& near) {
    if (&a == &b)
      adaptive_bvh::featurePairsWithin(*a.mesh, distance, near);
    else
      adaptive_bvh::featurePairsWithin(*a.mesh, a.tf, *b.mesh, b.tf, distance, near);
  };
  return collectFound(state.bodies, state.threads, pairs, query, result);
}

template <typename S>
std::size_t Scene<S>::vertexContacts(S margin, SceneVertexContacts<S>& result) const {
  const State& state = *state_;
  requireDistance(margin);
  state.requireCurrent();
  const Leased<std::vector<BodyPair>> leased;
  std::vector<BodyPair>& pairs = *leased;
  state.findPairs(double(margin), 1, pairs);
  for (std::size_t i = 0, count = pairs.size(); i < count; ++i)
    pairs.push_back({pairs[i].second, pairs[i].first});
  std::sort(pairs.begin(), pairs.end());
  const auto query = [&](const Body<S>& a, const Body<S>& b, VertexContacts<S>& near) {
    const bool has_inside = b.mesh ? stateOf(*b.mesh).topology->owners.isClosed()
                                   : b.geometry->getNodeType() != fcl::GEOM_OCTREE;
    if (a.mesh && has_inside)
      adaptive_bvh::vertexContacts(*a.mesh, a.tf, *b.geometry, b.tf, margin, near);
  };
  return collectFound(state.bodies, state.threads, pairs, query, result);
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
