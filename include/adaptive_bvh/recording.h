#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/collision_geometry.h>
#include <fcl/narrowphase/collision_result.h>
#include <fcl/narrowphase/distance_result.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/scene.h"

namespace adaptive_bvh {

class BodySource;  ///< What is read of a mesh or model (src/recording/body.h).

/// \file
/// Component `recording`: a run of deforming bodies as one HTML page that plays it. The page holds
/// all it needs (three.js, MIT licence, is in it): it opens in any browser, without a network.
/// Needs nlohmann-json and three.js to build.
///
///     adaptive_bvh::Recording recording;
///     recording.add(hose, hose_pose, "hose");  // a DeformableMesh, AdaptiveBVHModel or shape
///     recording.add(engine, engine_pose, "engine");
///     for (...) {
///       hose.update(positions);
///       adaptive_bvh::distance(&hose, hose_pose, &engine, engine_pose, request, result);
///       recording.frame(result);
///     }
///     recording.write("run.html");
///
/// `recording.follow(scene)` takes the place of `add` where a Scene holds the bodies.

/// A number for every vertex of a body, to be painted on it.
struct VertexValues {
  int body = 0;  ///< what Recording::add returned
  std::vector<double>
      values;  ///< one a vertex, finite; as `vertexDistances` (proximity.h) computes
};

/// Vectors in one frame, such as normals or forces. Drawn as arrows, all of one label in one
/// colour.
struct Arrows {
  std::string label;                   ///< names them on the page, e.g. "contact force, N"
  std::vector<fcl::Vector3d> origins;  ///< in the world
  std::vector<fcl::Vector3d> vectors;  ///< as many as origins
  /// Drawn length of a vector of length 1, in the bodies' unit. 0: the longest vector with this
  /// label in the run is drawn as long as an eighth of the scene.
  double scale = 0;
};

/// Pairs of points in one frame, such as the nearest points of feature pairs. Drawn as segments,
/// all of one label in one colour.
struct Segments {
  std::string label;                                ///< names them on the page
  std::vector<std::array<fcl::Vector3d, 2>> pairs;  ///< both ends of each, in the world
};

/// Triangles of a body that are coloured in one frame, by patch.
struct TrianglePatches {
  int body = 0;                        ///< what Recording::add returned
  std::vector<unsigned> triangles;     ///< indices; of a triangle that comes twice the last counts
  std::vector<std::uint64_t> patches;  ///< one a triangle. Equal numbers get equal colours.
};

/// What a run has computed in one frame. Every member may be left out; lengths are in the bodies'
/// unit, points in the world. Numbers that are not finite count as left out.
struct FrameResults {
  std::optional<double> distance;   ///< the smallest of this frame
  std::optional<double> update_ms;  ///< what the updates of this frame took, milliseconds
  std::optional<double> query_ms;   ///< what its queries took, milliseconds
  /// Of each pair: a nearest point on the first and on the second. Drawn as a segment.
  std::vector<std::array<fcl::Vector3d, 2>> nearest_points;
  std::optional<std::size_t> contact_count;    ///< pairs of triangles that touch
  std::vector<fcl::Vector3d> contacts;         ///< where they do: drawn as points
  std::vector<VertexValues> vertex_distances;  ///< at most one a body
  std::vector<Arrows> arrows;                  ///< vectors at points
  std::vector<Segments> segments;              ///< pairs of points beside nearest_points
  std::vector<TrianglePatches> patches;        ///< at most one a body
  std::map<std::string, double> series;        ///< numbers by label, charted (addToSeries)
  std::optional<double> time;                  ///< of the frame, e.g. that of a simulation
  std::string note;                            ///< shown with the frame

  FrameResults() = default;
  /// From a distance and, if requested, its nearest points.
  FrameResults(const fcl::DistanceResultd& result) { add(result); }
  /// From contacts. Their positions are shown if `enable_contact` was set.
  FrameResults(const fcl::CollisionResultd& result) { add(result); }

  /// Adds another result of this frame. The frame shows the smallest of several distances. Nearest
  /// points that are NaN were not computed.
  FrameResults& add(const fcl::DistanceResultd& result) {
    const double now = result.min_distance;
    if (!distance || now < *distance) distance = now;
    nearest_points.push_back({result.nearest_points[0], result.nearest_points[1]});
    return *this;
  }
  /// Adds another result of this frame: appends its contacts.
  FrameResults& add(const fcl::CollisionResultd& result) {
    contact_count = contact_count.value_or(0) + result.numContacts();
    for (std::size_t i = 0; i < result.numContacts(); ++i)
      contacts.push_back(result.getContact(i).pos);
    return *this;
  }
  /// What `vertexDistances` or `signedVertexDistances` computed for a body.
  FrameResults& addVertexDistances(int body, const std::vector<double>& values) {
    vertex_distances.push_back({body, values});
    return *this;
  }
  /// The nearest pair of a scene: its distance and points. Nothing where there is no pair.
  FrameResults& add(const SceneDistance& result) {
    if (!result.exists()) return *this;
    const double now = result.distance;
    if (!distance || now < *distance) distance = now;
    nearest_points.push_back({result.points[0], result.points[1]});
    return *this;
  }
  /// The contacts of a scene. Their positions are known where `enable_contact` was set.
  FrameResults& add(const SceneCollisions& result) {
    contact_count = contact_count.value_or(0) + result.contacts.size();
    for (const fcl::Contactd& contact : result.contacts) contacts.push_back(contact.pos);
    return *this;
  }
  /// Arrows at points, e.g. at VertexContacts::positions along VertexContacts::normals; see Arrows.
  FrameResults& addArrows(const std::string& label, const std::vector<fcl::Vector3d>& origins,
                          const std::vector<fcl::Vector3d>& vectors, double scale = 0) {
    Arrows added{label, {}, {}, scale};
    for (const auto& point : origins) added.origins.push_back(point);
    for (const auto& vector : vectors) added.vectors.push_back(vector);
    arrows.push_back(std::move(added));
    return *this;
  }
  /// Segments between points, e.g. FeatureDetails::nearest_points; see Segments.
  FrameResults& addSegments(const std::string& label,
                            const std::vector<std::array<fcl::Vector3d, 2>>& pairs) {
    Segments added{label, {}};
    for (const auto& [a, b] : pairs) added.pairs.push_back({a, b});
    segments.push_back(std::move(added));
    return *this;
  }
  /// Colours the triangles of `body` in contact regions, each region in a colour of its own.
  /// `regions` is ContactRegions::first where `body` is the first mesh, else
  /// ContactRegions::second. With the `ids` of a ContactTracker a region keeps its colour over
  /// frames. Throws std::invalid_argument when there are ids, but not one a region.
  FrameResults& colourTriangles(int body, const ContactPatches& regions,
                                const std::vector<std::uint64_t>& ids = {}) {
    const std::size_t count = regions.begins.empty() ? 0 : regions.begins.size() - 1;
    if (!ids.empty() && ids.size() != count)
      throw std::invalid_argument("FrameResults::colourTriangles: " + std::to_string(ids.size()) +
                                  " ids given for " + std::to_string(count) + " regions");
    TrianglePatches added{body, regions.triangles, {}};
    for (std::size_t r = 0; r < count; ++r)
      added.patches.resize(regions.begins[r + 1], ids.empty() ? r : ids[r]);
    patches.push_back(std::move(added));
    return *this;
  }
  /// A number of the program's own, such as an energy. The page charts all numbers of a label over
  /// the frames, or over their times.
  FrameResults& addToSeries(const std::string& label, double value) {
    series[label] = value;
    return *this;
  }
  /// How long updates and queries of this frame took, in milliseconds.
  FrameResults& addTimes(double of_updates, double of_queries) {
    update_ms = of_updates;
    query_ms = of_queries;
    return *this;
  }
};

/// How a run is recorded and shown.
struct RecordingOptions {
  std::string title = "A run";  ///< of the page
  std::string unit;             ///< of lengths, shown after them; e.g. "mm"
  /// Of an AdaptiveBVHModel: volumes are recorded down to this depth of the tree, 0 is its root: at
  /// most 2^(depth + 1) volumes of 64 bytes a body and frame. None below 0.
  int volume_depth = 6;
  /// Largest number of volumes below that depth that are recorded for each body and frame: those
  /// that the last update refitted, or an even sample of them.
  int deeper_refits = 100;
  double frames_per_second = 25;              ///< at which the page plays
  fcl::Vector3d up = fcl::Vector3d::UnitZ();  ///< which way is up in the world
  std::string time_unit = "s";                ///< of FrameResults::time
  /// The distances of vertices with the first and with the last colour, which the page can change.
  /// By default the least and the largest of the run.
  std::optional<std::array<double, 2>> vertex_distance_range;
};

/// Records frames of a run and writes them as a page.
///
/// **What is kept.** Of each body and frame the positions of its vertices, each coordinate in 16
/// bits of the box around the vertices: it is off by at most half of box / 65535, which the page
/// says. A body that did not change since the frame before is not stored again. Of an
/// AdaptiveBVHModel also the volumes down to RecordingOptions::volume_depth in single precision,
/// how much each is inflated, and whether the last update refitted it. About 6 bytes a vertex and
/// frame; `bytes()` says how many.
///
/// `frame` reads the bodies as a query does, and changes nothing in them; it records no traversal
/// statistics.
///
/// **Times.** A recording measures nothing: the page shows the times that FrameResults has, bit by
/// bit. Take them around updates and queries and before `frame` (MeshUpdate::seconds is the time of
/// an update), and they are without the work of the recording. `frame` replaces what the
/// processor's caches hold, though, so the next step may take longer: a query half as long again
/// after a frame of 5 MB, an update of 51,200 triangles 1 %. For times without that, let the
/// program run without a recording, keep the times of its steps, and pass them in a second run
/// (examples/tools/run_page.cpp).
///
/// **Memory.** A call that throws std::bad_alloc leaves bodies and frames as they were before.
/// (JSON is made by nlohmann-json, which allocates when it frees a value: the program ends where
/// that allocation fails.)
///
/// **Lifetime.** Keeps references: a mesh or model must live until the last call of `frame`.
/// `write` reads none. The object serves one thread at a time.
class Recording {
 public:
  /// Throws std::invalid_argument when `up` is zero or not finite, `frames_per_second` is not
  /// positive, `volume_depth` exceeds 20, `deeper_refits` is negative, or `vertex_distance_range`
  /// is not finite.
  explicit Recording(const RecordingOptions& options = RecordingOptions());
  ~Recording();
  /// The moved-from object can only be destroyed or assigned to.
  Recording(Recording&&) noexcept;
  Recording& operator=(Recording&&) noexcept;  ///< as the constructor
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  /// A DeformableMesh, FCL shape or octree, placed by `tf`, from the next frame on. Its triangles
  /// are those of now; shapes and octrees are copied. Returns its number: 0, 1, ... Planes and
  /// half-spaces are drawn as a square. Throws std::invalid_argument when the transform is not
  /// finite, when the body has no triangles, and on any other geometry.
  int add(const fcl::CollisionGeometryd& geometry, const fcl::Transform3d& tf,
          const std::string& name);
  /// A model of RSSd or OBBRSSd, with its volumes. Throws std::invalid_argument also when it is not
  /// built.
  template <typename BV>
  int add(const AdaptiveBVHModel<BV>& model, const fcl::Transform3d& tf, const std::string& name);
  /// A copy of a mesh that does not deform and is only looked at. Throws std::invalid_argument also
  /// when a vertex is not finite or a triangle names a missing one.
  int add(const TriangleMesh& mesh, const fcl::Transform3d& tf, const std::string& name);
  /// Takes a body out from the next frame on. Its number is never given again. Throws
  /// std::invalid_argument when there is no such body, and for one of a followed scene, which
  /// leaves the recording when it leaves the scene.
  void remove(int body);

  /// Records the bodies of a scene with their transforms: `frame` reads them, adds bodies that are
  /// new in the scene and removes bodies that have left it. The scene must live until the last call
  /// of `frame`. `name` names a body on the page, by default "body 7" for the id 7; what it throws,
  /// this call, `frame` and `bodyOf` throw, and change nothing. Throws std::logic_error when a
  /// scene is followed already.
  void follow(const Scene& scene, const std::function<std::string(BodyId)>& name = {});
  /// The number of a body of the followed scene, for VertexValues and TrianglePatches. Throws
  /// std::invalid_argument when no scene with such a body is followed.
  int bodyOf(BodyId id);

  /// The body's transform from the next frame on. Throws std::invalid_argument when there is no
  /// such body or the transform is not finite.
  void place(int body, const fcl::Transform3d& tf);

  /// Records the bodies as they are now, with what was computed. Takes about 12 ns a vertex that
  /// moved. Throws std::logic_error when there is no body, and std::invalid_argument when a body
  /// has another number of vertices or triangles than when it was added, when distances of vertices
  /// or patches name a missing body or triangle, and when arrays that belong together differ in
  /// length. Then nothing is recorded.
  void frame(const FrameResults& results = FrameResults());

  int bodies() const;         ///< how many were added, including removed ones
  int frames() const;         ///< how many were recorded
  std::size_t bytes() const;  ///< what they take in memory, about; on the page up to 4/3 of it

  /// Writes the page: one file of about 0.9 megabytes and 4/3 of `bytes()`, as a whole or not at
  /// all. Throws std::logic_error when no frame was recorded, and std::runtime_error,
  /// which says why, when the file cannot be written.
  void write(const std::string& path) const;
  /// Writes the page to a stream; its state says whether that worked. Throws std::logic_error when
  /// no frame was recorded.
  void write(std::ostream& out) const;

 private:
  struct State;
  int add(std::unique_ptr<BodySource> source, const fcl::Transform3d& tf, const std::string& name);

  std::unique_ptr<State> state_;
};

}  // namespace adaptive_bvh
