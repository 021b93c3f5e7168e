#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/scene.h"

namespace adaptive_bvh {

/// \file
/// Near pairs that are kept from step to step, for solvers that ask again in every step and
/// iteration: of one mesh with itself, of two meshes, or of a Scene.
///
/// **Answers.** After `update` a ContactSet holds the pairs that `pairsWithin` or
/// `featurePairsWithin` would find for the present positions: the same ones, pair by pair, whatever
/// happened since the last update. Any number of updates of the meshes may come between, also an
/// assignment, an older snapshot, or a jump. The same tests decide, with the same rounding
/// (proximity.h).
///
/// **Numbers.** Each pair has a number. It keeps it as long as it lives: from the update that adds
/// it to the update that removes it. Arrays of the caller (impulses, states of friction) are
/// indexed by it. Numbers are small: a number that an update has removed may be given to another
/// pair in a later update. `compact` closes the gaps, and says how to move the arrays. If a mesh
/// gets other triangles, all of its pairs are removed. Numbers do not depend on the number of
/// threads.
///
/// **Time.** An update costs what has changed. The set keeps the pairs that are a little farther
/// apart, too, and how far both parts of a pair may move, one relative to the other, before the
/// pair can change sides. So an update measures the motion, and tests the pairs that may have
/// changed. Parts of the meshes are searched again that have moved, one relative to the other, by
/// more than that margin. The set measures against the positions that it saw; the meshes keep
/// nothing for it. If everything moves too far in a step to gain by this, an update searches as a
/// new query does.
///
/// **Memory.** 16 bytes for each number, 24 in a Scene; 60 to 75 for each pair within the margin,
/// in two lists that are filled in turns; there are one to three times as many of these as there
/// are pairs. 100 to 130 for each triangle that has had such a pair. If most triangles have one,
/// also 40 for each vertex, and 10 to 15 for each triangle.
///
/// **Errors.** std::invalid_argument as in proximity.h: from a constructor, if the request is not
/// as it says; from `update`, if a transform is not a rigid motion. A call that throws leaves the
/// pairs and the numbers as they were, also after std::bad_alloc, and it can be repeated.
///
/// **Threads.** One object serves one thread at a time; several may share meshes. An update runs on
/// several threads if DeformableMesh::setThreads or Scene::setThreads allows it.

/// What a ContactSet holds.
enum class ContactElements {
  Triangles,  ///< pairs of triangles, as pairsWithin
  Features,   ///< pairs of a vertex and a face, and of two edges, as featurePairsWithin
};

/// Request of a ContactSet. It has a copy: of the lists of ignored pairs and the neighbourhood,
/// too. A function in IgnoredPairs must return the same value for the same pair as long as the set
/// lives; it is called for pairs that enter the set.
struct ContactSetRequest {
  double distance = 0;  ///< largest distance of a pair; with 0 the pairs that touch
  ContactElements elements = ContactElements::Triangles;  ///< what is paired
  /// Pairs to leave out. `neighbours` is not BeyondShared. In a Scene it must be SharedVertex, and
  /// `surface` null.
  Ignored ignored = {};
};

/// The pairs of one kind in a ContactSet, by their numbers.
struct NumberedPairs {
  /// Stands for a number that does not exist.
  static constexpr unsigned kNone = ~0u;

  /// By number: the pair, as in the result of the query; {kNone, kNone} for a free number.
  std::vector<FeaturePair> pairs;
  /// By number: the bodies of the pair, the first with the smaller id. For a Scene only.
  std::vector<BodyPair> bodies;
  std::vector<unsigned> added;    ///< numbers of the pairs that the last update added
  std::vector<unsigned> removed;  ///< numbers of the pairs that the last update removed
  /// The pairs of `removed`, in the same order.
  std::vector<FeaturePair> removed_pairs;
  std::size_t count = 0;  ///< number of pairs, without free numbers

  /// Whether a pair has this number.
  bool contains(unsigned number) const {
    return number < pairs.size() && pairs[number].first != kNone;
  }
  /// Overwrites `numbers` with those of all pairs, in increasing order.
  void list(std::vector<unsigned>& numbers) const {
    numbers.clear();
    for (unsigned n = 0; n < pairs.size(); ++n)
      if (pairs[n].first != kNone) numbers.push_back(n);
  }
};

/// How ContactSet::compact has changed the numbers, for each kind of pairs: the new number by the
/// old one, or NumberedPairs::kNone if that was free. New numbers are not larger than old ones.
struct Renumbering {
  std::vector<unsigned> triangles;    ///< of pairs of triangles
  std::vector<unsigned> vertex_face;  ///< of FeatureKind::VertexFace
  std::vector<unsigned> face_vertex;  ///< of FeatureKind::FaceVertex
  std::vector<unsigned> edge_edge;    ///< of FeatureKind::EdgeEdge

  /// Moves the elements of the caller's array, which has one for each old number, to the new
  /// numbers. `to`: one of the members above.
  template <typename T>
  static void apply(const std::vector<unsigned>& to, std::vector<T>& values) {
    std::size_t count = 0;
    for (std::size_t n = 0; n < to.size(); ++n)
      if (to[n] != NumberedPairs::kNone) {
        if (to[n] != n) values[to[n]] = std::move(values[n]);
        ++count;
      }
    values.resize(count);
  }
};

/// The work of an update of a ContactSet.
struct ContactSetWork {
  std::size_t candidates = 0;  ///< pairs of triangles that are kept, within the margin
  std::size_t tested = 0;      ///< of these, pairs that the last update tested
  std::size_t searches = 0;  ///< searches so far, of all meshes or of a part, for each pair of them
};

/// Near pairs, kept from step to step; \ref contact_set.h describes answers, numbers, errors and
/// threads. The set is empty before the first update.
class ContactSet {
 public:
  using Transform = fcl::Transform3d;  ///< from a mesh's frame to the world

  /// The pairs of one mesh with itself. Keeps a reference: the mesh must outlive this object.
  ContactSet(const DeformableMesh& mesh, const ContactSetRequest& request);
  /// The pairs of two meshes, likewise.
  ContactSet(const DeformableMesh& first, const DeformableMesh& second,
             const ContactSetRequest& request);
  /// The pairs of all bodies of a scene that are meshes, and of meshes with themselves if
  /// BodyOptions::self_collision says so. Keeps a reference to the scene, which must not be moved.
  ContactSet(const Scene& scene, const ContactSetRequest& request);
  ~ContactSet();
  ContactSet(ContactSet&&) noexcept;             ///< the source can then only be assigned to
  ContactSet& operator=(ContactSet&&) noexcept;  ///< the source can then only be assigned to
  ContactSet(const ContactSet&);                 ///< a copy with the same numbers; both go on alone
  ContactSet& operator=(const ContactSet&);      ///< a copy with the same numbers

  /// Brings the set up to date with the meshes or the scene. Returns the number of pairs. Two
  /// meshes are where the last call of the other `update` has placed them, at first in the world's
  /// frame. For a scene, call Scene::update before; otherwise throws std::logic_error. Returns at
  /// once if nothing has changed, and allocates nothing in steady steps on one thread.
  std::size_t update();
  /// The same, with the transforms of the two meshes. Of one mesh with itself and of a scene,
  /// throws std::logic_error.
  std::size_t update(const Transform& tf1, const Transform& tf2);

  /// The pairs of triangles. Empty for a set of features, so that one loop reads all kinds of pairs
  /// of any set; Python raises ValueError.
  const NumberedPairs& triangles() const;
  /// The pairs of features of a kind; likewise empty for a set of triangles. Of one mesh with
  /// itself FeatureKind::FaceVertex is empty.
  const NumberedPairs& features(FeatureKind kind) const;
  /// Number of pairs of all kinds.
  std::size_t size() const;

  /// Gives the pairs of each kind the numbers from 0 on, in the order of their old numbers. Then
  /// `added` and `removed` of all kinds are empty.
  void compact(Renumbering& moved);

  /// Computes distance, nearest points and normal of pairs of triangles, for the present positions
  /// and the transforms of the last update. `coordinates` stays empty. A normal has the length 1
  /// and points from the first to the second; of triangles that touch it is that of their contact
  /// in `collide`. `result` is overwritten, in the order of `numbers`. Throws std::invalid_argument
  /// if no pair has one of the numbers.
  void details(const std::vector<unsigned>& numbers, FeatureDetails& result) const;
  /// Computes the details of pairs of features, as featurePairDetails.
  void details(FeatureKind kind, const std::vector<unsigned>& numbers,
               FeatureDetails& result) const;

  /// Adds to `result` the contacts of the pairs of triangles in this set that touch, as `collide`
  /// and `selfCollide` find them: all of theirs, whatever the set's distance is. The order is that
  /// of the numbers. Returns the number of contacts in the result. For a set of features, throws
  /// std::logic_error.
  std::size_t contacts(const fcl::CollisionRequestd& request, fcl::CollisionResultd& result) const;

  /// The work of the last update.
  ContactSetWork work() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace adaptive_bvh
