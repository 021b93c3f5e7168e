// ContactSet: the border of KeptPairs for one mesh, two, or the bodies of a scene.
#include "adaptive_bvh/contact_set.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>

#include "base/leased.h"
#include "base/task_pool.h"
#include "query/contacts/contacts.h"
#include "query/pair_filter.h"
#include "query/within/kept_pairs.h"
#include "query/within/near_pairs.h"
#include "scene/scene_state.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {
namespace {

/// Throws std::invalid_argument if a request is not as ContactSetRequest says.
std::shared_ptr<const KeptRequest> checked(const ContactSetRequest& request, bool has_self) {
  requireDistance(request.distance);
  if (request.ignored.neighbours == NeighbourFilter::BeyondShared)
    throw std::invalid_argument(
        "adaptive_bvh: a ContactSet has no filter BeyondShared: neighbours are at the distance 0");
  requireSorted(request.ignored, has_self);
  return std::make_shared<const KeptRequest>(request);
}

/// The direction from one point to another; that of the contact of two triangles that touch.
fcl::Vector3d normalBetween(const TrianglePoints& a, const TrianglePoints& b,
                            const TriangleGap& gap) {
  if (!(gap.distance > 0)) return contactOf(a, b).normal;
  const fcl::Vector3d between = gap.points.second - gap.points.first;
  const double size = between.lpNorm<Eigen::Infinity>();
  return size > 0 ? fcl::Vector3d((between / size).normalized()) : contactOf(a, b).normal;
}

void addDetail(const KeptMeshes& meshes, const fcl::Transform3d& tf, const FeaturePair& pair,
               FeatureDetails& result) {
  const TrianglePoints p = meshes.first.pointsOf(pair.first);
  TrianglePoints q = meshes.second.pointsOf(pair.second);
  if (!meshes.is_self)
    for (fcl::Vector3d& x : q) x = meshes.to_first(x);
  const TriangleGap gap = gapOf(p, q);
  result.distances.push_back(gap.distance);
  result.nearest_points.push_back({tf * gap.points.first, tf * gap.points.second});
  result.normals.push_back(tf.linear() * normalBetween(p, q, gap));
}

void appendDetails(const FeatureDetails& from, FeatureDetails& to) {
  const auto appendTo = [](const auto& values, auto& all) {
    all.insert(all.end(), values.begin(), values.end());
  };
  appendTo(from.distances, to.distances);
  appendTo(from.nearest_points, to.nearest_points);
  appendTo(from.coordinates, to.coordinates);
  appendTo(from.normals, to.normals);
}
/// The member for a kind, of FeaturePairs and of FeaturePairDetails.
template <typename OfKinds>
auto& ofKind(OfKinds& all, FeatureKind kind) {
  return kind == FeatureKind::VertexFace   ? all.vertex_face
         : kind == FeatureKind::FaceVertex ? all.face_vertex
                                           : all.edge_edge;
}

/// Adds the contacts of pairs of triangles that touch.
void addTouching(const KeptMeshes& meshes, const fcl::Transform3d& tf,
                 const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                 const FeaturePair* pairs, std::size_t count, const CollisionQuery& query) {
  const PlacedTriangles first{&o1, meshes.first.mesh.view(), tf},
      second{&o2, meshes.second.mesh.view(), meshes.is_self ? tf : meshes.second.tf};
  for (std::size_t i = 0; i < count && !query.isSatisfied(); ++i)
    addContactsOf(first, second, meshes.to_first, int(pairs[i].first), int(pairs[i].second), false,
                  meshes.is_self ? 1 : 2, query.request, query.result);
}

}  // namespace

struct ContactSet::State {
  /// The pairs of two bodies, or of one with itself, and the last update of the set in which the
  /// bodies were near.
  struct OfBodies {
    KeptPairs pairs;
    std::uint64_t update = 0;
  };

  State(const DeformableMesh* one, const DeformableMesh* other, const Scene* of_scene,
        const ContactSetRequest& request_given)
      : first(one),
        second(other),
        scene(of_scene),
        request(checked(request_given, !second)),
        numbers(scene != nullptr) {
    const Ignored& ignored = request->ignored;
    if (scene && (ignored.neighbours != NeighbourFilter::SharedVertex || ignored.surface))
      throw std::invalid_argument(
          "adaptive_bvh: a ContactSet of a Scene ignores the neighbours SharedVertex only");
    if (first && !second) surfaceOf(ignored, stateOf(*first));  // refuses those of another mesh
  }

  const DeformableMesh *first, *second;  ///< null for a scene; `second` for one mesh, too
  const Scene* scene;
  Transform tf1 = Transform::Identity(), tf2 = Transform::Identity();
  std::shared_ptr<const KeptRequest> request;
  PairNumbers numbers;
  KeptPairs pairs;                         ///< of meshes
  std::map<BodyPair, OfBodies> of_bodies;  ///< of a scene
  std::uint64_t updates = 0;               ///< of a scene, so far
  std::uint64_t scene_version = 0;         ///< of the last update; 0 before the first

  void updateMeshes(const Transform& to1, const Transform& to2) {
    update(second ? KeptMeshes({*first, to1}, {*second, to2}) : KeptMeshes(stateOf(*first)));
    tf1 = to1;
    tf2 = to2;
  }
  void update(const KeptMeshes& meshes) {
    if (!pairs.prepare(meshes, *request)) return numbers.begin({});
    numbers.begin(pairs.counts());
    pairs.commit(meshes, *request, {}, numbers);
  }

  void updateScene();
  const SceneState& bodies() const { return detail::SceneAccess::state(*scene); }

  /// The meshes of a pair; `pair`: of the scene.
  KeptMeshes meshesOf(const BodyPair& pair) const {
    if (!scene)
      return second ? KeptMeshes({*first, tf1}, {*second, tf2}) : KeptMeshes(stateOf(*first));
    const Body &a = bodies().bodies[bodies().indexOf(pair.first)],
               &b = bodies().bodies[bodies().indexOf(pair.second)];
    return keptMeshes(a, b);
  }
  static KeptMeshes keptMeshes(const Body& a, const Body& b) {
    return &a == &b ? KeptMeshes(a.mesh()) : KeptMeshes(a.placedMesh(), b.placedMesh());
  }
  /// Where results of a pair are placed in the world.
  fcl::Transform3d placeOf(const BodyPair& pair, const KeptMeshes& meshes) const {
    if (scene && meshes.is_self) return bodies().bodies[bodies().indexOf(pair.first)].tf;
    return meshes.first.tf;
  }
  /// Calls act(meshes, transform, bodies, pairs, count) for numbers, together as long as they are
  /// of the same meshes. Throws std::invalid_argument if there is no pair with a number.
  template <typename Act>
  void forEachMeshes(unsigned kind, const std::vector<unsigned>& of, const Act& act) const {
    const NumberedPairs& list = numbers[kind];
    const Leased<std::vector<FeaturePair>> leased;
    std::vector<FeaturePair>& same = *leased;
    for (const unsigned number : of)
      if (!list.contains(number))
        throw std::invalid_argument("adaptive_bvh: a ContactSet has no pair with the number " +
                                    std::to_string(number));
    for (std::size_t i = 0; i < of.size();) {
      const BodyPair bodies_of = scene ? list.bodies[of[i]] : BodyPair{};
      same.clear();
      for (; i < of.size() && (!scene || list.bodies[of[i]] == bodies_of); ++i)
        same.push_back(list.pairs[of[i]]);
      const KeptMeshes meshes = meshesOf(bodies_of);
      act(meshes, placeOf(bodies_of, meshes), bodies_of, same);
    }
  }
};

/// Prepares all pairs of bodies, on several threads; then changes the numbers, in their order.
void ContactSet::State::updateScene() {
  const SceneState& state = bodies();
  state.requireCurrent();
  if (scene_version == state.version && scene_version != 0) return numbers.begin({});
  const Leased<std::vector<BodyPair>> near;
  state.findPairs(request->distance, 2, *near);
  state.addSelfPairs(*near);
  struct Task {
    const Body *a, *b;
    KeptPairs* pairs;
    bool has_changed;
  };
  const Leased<std::vector<Task>> leased;
  std::vector<Task>& tasks = *leased;
  tasks.clear();
  ++updates;
  for (const BodyPair& pair : *near) {
    const Body &a = state.bodies[pair.first], &b = state.bodies[pair.second];
    OfBodies& kept = of_bodies[{a.id, b.id}];
    kept.update = updates;
    tasks.push_back({&a, &b, &kept.pairs, false});
  }
  const TaskPool pool(tasks.size() > 1 ? state.threads : 1);
  pool.forEach(static_cast<int>(tasks.size()), [&](int i, int) {
    Task& task = tasks[std::size_t(i)];
    task.has_changed = task.pairs->prepare(keptMeshes(*task.a, *task.b), *request);
  });
  PairCounts counts;
  for (const Task& task : tasks)
    if (task.has_changed) counts.add(task.pairs->counts());
  for (auto& [bodies_of, kept] : of_bodies)
    if (kept.update != updates) {
      kept.pairs.prepareRemoval(*request);
      counts.add(kept.pairs.counts());
    }
  numbers.begin(counts);
  for (const Task& task : tasks)
    if (task.has_changed)
      task.pairs->commit(keptMeshes(*task.a, *task.b), *request, {task.a->id, task.b->id}, numbers);
  for (auto entry = of_bodies.begin(); entry != of_bodies.end();) {
    const auto here = entry++;
    if (here->second.update == updates) continue;
    here->second.pairs.commitRemoval(numbers);
    of_bodies.erase(here);
  }
  scene_version = state.version;
}

ContactSet::ContactSet(const DeformableMesh& mesh, const ContactSetRequest& request)
    : state_(std::make_unique<State>(&mesh, nullptr, nullptr, request)) {}
ContactSet::ContactSet(const DeformableMesh& first, const DeformableMesh& second,
                       const ContactSetRequest& request)
    : state_(std::make_unique<State>(&first, &second, nullptr, request)) {}
ContactSet::ContactSet(const Scene& scene, const ContactSetRequest& request)
    : state_(std::make_unique<State>(nullptr, nullptr, &scene, request)) {}
ContactSet::~ContactSet() = default;
ContactSet::ContactSet(ContactSet&&) noexcept = default;
ContactSet& ContactSet::operator=(ContactSet&&) noexcept = default;
ContactSet::ContactSet(const ContactSet& other) : state_(std::make_unique<State>(*other.state_)) {}
ContactSet& ContactSet::operator=(const ContactSet& other) { return *this = ContactSet(other); }

std::size_t ContactSet::update() {
  state_->scene ? state_->updateScene() : state_->updateMeshes(state_->tf1, state_->tf2);
  return size();
}

std::size_t ContactSet::update(const Transform& tf1, const Transform& tf2) {
  if (!state_->second)
    throw std::logic_error("adaptive_bvh: only a ContactSet of two meshes takes transforms");
  requireRigid(tf1);
  requireRigid(tf2);
  state_->updateMeshes(tf1, tf2);
  return size();
}

const NumberedPairs& ContactSet::triangles() const {
  static const NumberedPairs none;
  return state_->request->has_features ? none : state_->numbers[0];
}

const NumberedPairs& ContactSet::features(FeatureKind kind) const {
  static const NumberedPairs none;
  return state_->request->has_features ? state_->numbers[unsigned(kind)] : none;
}

std::size_t ContactSet::size() const {
  std::size_t count = 0;
  for (unsigned kind = 0; kind < 3; ++kind) count += state_->numbers[kind].count;
  return count;
}

void ContactSet::compact(Renumbering& moved) {
  std::array<std::vector<unsigned>, 3> kinds;
  state_->numbers.compact(kinds);
  state_->pairs.renumber(kinds);
  for (auto& entry : state_->of_bodies) entry.second.pairs.renumber(kinds);
  moved = {};
  (state_->request->has_features ? moved.vertex_face : moved.triangles) = std::move(kinds[0]);
  moved.face_vertex = std::move(kinds[1]);
  moved.edge_edge = std::move(kinds[2]);
}

void ContactSet::details(const std::vector<unsigned>& numbers, FeatureDetails& result) const {
  if (state_->request->has_features && !numbers.empty())
    throw std::invalid_argument("adaptive_bvh: a ContactSet of features has no triangles");
  result.resize(0);
  state_->forEachMeshes(0, numbers,
                        [&](const KeptMeshes& meshes, const fcl::Transform3d& tf, const BodyPair&,
                            const std::vector<FeaturePair>& pairs) {
                          for (const FeaturePair& pair : pairs) addDetail(meshes, tf, pair, result);
                        });
}

void ContactSet::details(FeatureKind kind, const std::vector<unsigned>& numbers,
                         FeatureDetails& result) const {
  if (!state_->request->has_features && !numbers.empty())
    throw std::invalid_argument("adaptive_bvh: a ContactSet of triangles has no features");
  const Leased<FeaturePairDetails> found;
  const Leased<FeaturePairs> asked;
  result.resize(0);
  state_->forEachMeshes(unsigned(kind), numbers,
                        [&](const KeptMeshes& meshes, const fcl::Transform3d& tf, const BodyPair&,
                            const std::vector<FeaturePair>& pairs) {
                          asked->clear();
                          ofKind(*asked, kind) = pairs;
                          findFeatureDetails({meshes.first.mesh, tf}, meshes.second.mesh,
                                             meshes.to_first, *asked, *found);
                          appendDetails(ofKind(*found, kind), result);
                        });
}

std::size_t ContactSet::contacts(const fcl::CollisionRequestd& request,
                                 fcl::CollisionResultd& result) const {
  if (state_->request->has_features)
    throw std::logic_error("adaptive_bvh: a ContactSet of features has no contacts of triangles");
  const CollisionQuery query{request, result};
  if (request.num_max_contacts == 0 || query.isSatisfied()) return result.numContacts();
  const Leased<std::vector<unsigned>> all;
  state_->numbers[0].list(*all);
  state_->forEachMeshes(0, *all,
                        [&](const KeptMeshes& meshes, const fcl::Transform3d& tf,
                            const BodyPair& bodies, const std::vector<FeaturePair>& pairs) {
                          const fcl::CollisionGeometryd *o1 = state_->first, *o2 = state_->second;
                          if (state_->scene) {
                            o1 = &state_->scene->geometry(bodies.first);
                            o2 = &state_->scene->geometry(bodies.second);
                          } else if (!o2) {
                            o2 = o1;
                          }
                          addTouching(meshes, tf, *o1, *o2, pairs.data(), pairs.size(), query);
                        });
  return result.numContacts();
}

ContactSetWork ContactSet::work() const {
  ContactSetWork work;
  const auto add = [&](const KeptPairs& pairs) {
    work.candidates += pairs.numCandidates();
    work.tested += pairs.tested();
    work.searches += pairs.searches();
  };
  add(state_->pairs);
  for (const auto& entry : state_->of_bodies) add(entry.second.pairs);
  return work;
}

}  // namespace adaptive_bvh
