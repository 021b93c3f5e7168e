// A scene's queries of all pairs: a query of two bodies for each pair, collected in order of pairs.
#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "base/leased.h"
#include "base/task_pool.h"
#include "dispatch/contained.h"
#include "dispatch/pairs.h"
#include "dispatch/shape_search.h"
#include "query/contacts/contacts.h"
#include "query/contacts/vertex_contacts.h"
#include "query/within/near_pairs.h"
#include "scene/scene_state.h"

namespace adaptive_bvh {
namespace {

using ContactList = std::vector<fcl::Contactd>;

// The vectors of a result. Vectors that were not requested are empty.
auto vectorsOf(ContactList& contacts) { return std::tie(contacts); }
auto vectorsOf(TrianglePairs& pairs) {
  return std::tie(pairs.triangles, pairs.distances, pairs.nearest_points);
}
auto vectorsOf(FeaturePairs& pairs) {
  return std::tie(pairs.vertex_face, pairs.face_vertex, pairs.edge_edge);
}

auto vectorsOf(VertexContacts& c) {
  return std::tie(c.vertices, c.distances, c.positions, c.nearest_points, c.normals, c.triangles,
                  c.barycentric, c.areas);
}

/// The sizes of a result's vectors: a position in the list of results.
using Mark = std::array<std::size_t, 8>;

template <typename Data>
Mark endOf(Data& data) {
  Mark mark{};
  std::size_t i = 0;
  std::apply([&](auto&... vectors) { ((mark[i++] = vectors.size()), ...); }, vectorsOf(data));
  return mark;
}

/// Appends the elements of `from` between two marks to `to`.
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

/// The range of a pair's results in the list of its thread.
struct Found {
  std::size_t slot;  ///< number of the thread
  Mark begin, end;
  bool is_reported;
};

/// Calls query(pair, data) for all pairs, on several threads; `query` appends results to `data`,
/// and returns whether the pair is reported. For each reported pair, in order, appends its results
/// to `found`, then calls take(pair, end of `found`), which returns whether to continue.
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
  const Leased<std::vector<Found>> range_memory;
  std::vector<Data>& lists = *memory;          // by thread
  std::vector<Found>& ranges = *range_memory;  // by pair
  lists.resize(std::max(lists.size(), std::size_t(pool.size())));
  for (Data& data : lists) data.clear();
  ranges.resize(pairs.size());
  pool.forEach(static_cast<int>(pairs.size()), [&](int task, int slot) {
    const auto pair = static_cast<std::size_t>(task);
    Data& data = lists[static_cast<std::size_t>(slot)];
    Found& range = ranges[pair];
    range.slot = static_cast<std::size_t>(slot);
    range.begin = endOf(data);
    range.is_reported = query(pairs[pair], data);
    range.end = endOf(data);
  });
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Found& range = ranges[i];
    if (!range.is_reported) continue;
    append(lists[range.slot], range.begin, range.end, found);
    if (!take(pairs[i], endOf(found))) return;
  }
}

/// Returns a contact with the bodies exchanged.
fcl::Contactd reversed(fcl::Contactd contact) {
  std::swap(contact.o1, contact.o2);
  std::swap(contact.b1, contact.b2);
  contact.normal = -contact.normal;
  return contact;
}

/// Adds the contacts of a body inside another one, which is solid. The surfaces must not touch.
void addInside(const Body& a, const QueryObject& first, const Body& b, const QueryObject& second,
               const CollisionQuery& query) {
  if (b.options.solid && first.kind() == ObjectKind::Mesh && !query.isSatisfied())
    addContained(first.mesh(), second.mesh(), false, a.geometry.given(), b.geometry.given(), query);
  if (!a.options.solid || query.isSatisfied()) return;
  if (second.kind() == ObjectKind::Mesh)
    addContained(second.mesh(), first.mesh(), true, a.geometry.given(), b.geometry.given(), query);
  if (second.kind() == ObjectKind::Shape)
    addContained(second.solid(), first.mesh(), a.geometry.given(), b.geometry.given(), query);
}

/// Adds the contacts of two bodies. Returns whether contacts have the bodies in reverse order.
bool collideBodies(const Body& a, const Body& b, const CollisionQuery& query) {
  const QueryObject first(a.object()), second(b.object());
  const PairSearch& pair = searchOf(first.kind(), second.kind());
  if (pair.is_swapped) return !collideBodies(b, a, query);
  pair.collide(first, second, a.geometry.given(), b.geometry.given(), query);
  if (!query.result.isCollision()) addInside(a, first, b, second, query);
  if (!query.request.enable_contact) unsetFields(query.result, 0);
  return false;
}

/// Whether two bodies, or a mesh and itself, touch. Appends their contacts to `found`.
bool collidePair(const Body& a, const Body& b, const SceneCollisionRequest& request,
                 ContactList& found) {
  const fcl::CollisionRequestd limited(std::max<std::size_t>(1, request.contacts_per_pair),
                                       request.enable_contact && request.contacts_per_pair > 0);
  const Leased<fcl::CollisionResultd> leased;
  fcl::CollisionResultd& result = *leased;
  result.clear();
  bool is_reversed = false;
  if (&a == &b) {
    const PlacedMesh mesh(a.placedMesh());
    collideWithItself({a.geometry.given(), mesh}, Ignored(), {limited, result});
  } else {
    is_reversed = collideBodies(a, b, {limited, result});
  }
  for (std::size_t i = 0; i < result.numContacts() && i < request.contacts_per_pair; ++i)
    found.push_back(is_reversed ? reversed(result.getContact(i)) : result.getContact(i));
  return result.isCollision();
}

/// The mark as an offset of the type to which the second argument points.
std::size_t offsetOf(const Mark& mark, const std::size_t*) { return mark[0]; }
std::array<std::size_t, 3> offsetOf(const Mark& mark, const std::array<std::size_t, 3>*) {
  return {mark[0], mark[1], mark[2]};
}

/// Overwrites `result`, of which `found` is a member, by the results of query(first, second, data)
/// for all pairs, as in queryPairs. If `first_only`, stops at the first reported pair.
template <typename Query, typename Result, typename Data>
void collect(const std::vector<Body>& bodies, int threads, const std::vector<BodyPair>& pairs,
             const Query& query, Result& result, Data& found, bool first_only = false) {
  using Offset = typename decltype(result.begins)::value_type;
  result.pairs.clear();
  result.begins.assign(1, Offset());
  found.clear();
  queryPairs(
      first_only ? 1 : threads, pairs,
      [&](const BodyPair& pair, Data& data) {
        return query(bodies[pair.first], bodies[pair.second], data);
      },
      found,
      [&](const BodyPair& pair, const Mark& mark) {
        result.pairs.push_back({bodies[pair.first].id, bodies[pair.second].id});
        result.begins.push_back(offsetOf(mark, static_cast<const Offset*>(nullptr)));
        return !first_only;
      });
}

/// `collect` with query(first, second, near), which overwrites `near`. Reports pairs with results.
template <typename Query, typename Result>
void collectFound(const std::vector<Body>& bodies, int threads, const std::vector<BodyPair>& pairs,
                  const Query& query, Result& result) {
  using Data = decltype(result.found);
  collect(
      bodies, threads, pairs,
      [&](const Body& a, const Body& b, Data& found) {
        const Leased<Data> near;
        near->clear();
        query(a, b, *near);
        append(*near, {}, endOf(*near), found);
        return near->size() > 0;
      },
      result, result.found);
}

}  // namespace

void SceneState::collide(const SceneCollisionRequest& request, SceneCollisions& result) const {
  requireCurrent();
  const Leased<std::vector<BodyPair>> pairs;
  findPairs(0, 0, *pairs);
  addSelfPairs(*pairs);
  collect(
      bodies, threads, *pairs,
      [&](const Body& a, const Body& b, ContactList& found) {
        return collidePair(a, b, request, found);
      },
      result, result.contacts, request.first_only);
}

void SceneState::pairsWithin(const ProximityRequest& request, SceneTrianglePairs& result) const {
  requireCurrent();
  const Leased<std::vector<BodyPair>> pairs;
  findPairs(request.distance, 2, *pairs);
  addSelfPairs(*pairs);
  const auto query = [&](const Body& a, const Body& b, TrianglePairs& near) {
    if (&a != &b) return findPairsWithin({a.placedMesh(), b.placedMesh()}, request, near);
    findPairsWithin(a.inBodyFrame(), request, near);
    for (auto& points : near.nearest_points)
      for (fcl::Vector3d& x : points) x = a.tf * x;
  };
  collectFound(bodies, threads, *pairs, query, result);
}

void SceneState::featurePairsWithin(double distance, SceneFeaturePairs& result) const {
  requireCurrent();
  const Leased<std::vector<BodyPair>> pairs;
  findPairs(distance, 2, *pairs);
  addSelfPairs(*pairs);
  FeatureProximityRequest request;
  request.distance = distance;
  const auto query = [&](const Body& a, const Body& b, FeaturePairs& near) {
    if (&a == &b)
      findFeaturePairsWithin(a.inBodyFrame(), request, near);
    else
      findFeaturePairsWithin({a.placedMesh(), b.placedMesh()}, request, near);
  };
  collectFound(bodies, threads, *pairs, query, result);
}

void SceneState::vertexContacts(double margin, SceneVertexContacts& result) const {
  requireCurrent();
  const Leased<std::vector<BodyPair>> leased;
  std::vector<BodyPair>& pairs = *leased;
  findPairs(margin, 1, pairs);
  for (std::size_t i = 0, count = pairs.size(); i < count; ++i)
    pairs.push_back({pairs[i].second, pairs[i].first});
  std::sort(pairs.begin(), pairs.end());
  const auto query = [&](const Body& a, const Body& b, VertexContacts& near) {
    if (!a.isMesh() || b.geometry.kind() == ObjectKind::Octree) return;
    if (!b.isMesh())
      findVertexContacts(a.placedMesh(), b.object().parts().shape(), b.tf, margin, near);
    else if (b.mesh().topology->owners.isClosed())
      findVertexContacts(a.placedMesh(), b.placedMesh(), margin, near);
  };
  collectFound(bodies, threads, pairs, query, result);
}

}  // namespace adaptive_bvh
