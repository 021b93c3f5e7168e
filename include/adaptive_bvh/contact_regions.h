#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "adaptive_bvh/deformable_mesh.h"

namespace adaptive_bvh {

/// \file
/// Overlap of two closed meshes: the curves along which their surfaces cross, and the connected
/// regions of the volume that both enclose.
///
/// **Exactness.** Which edges cross which triangles is decided without any error, for the vertices
/// as rounded to double precision in the first's frame. Ties are broken as if `first` were moved by
/// an infinitely small step along its x axis, and by yet smaller steps along y and z, so no vertex
/// lies on a face and no edge on an edge. Coplanar faces count for one of the meshes only, and
/// bodies that only touch may have a region without volume. Positions, areas and volumes are
/// computed in double precision. Bodies of any size are answered, as far as meshes have such
/// coordinates; a power of two scales every result exactly, but for what underflows.
///
/// **Inside.** Triangles face outward: their corners are counter-clockwise seen from outside. A
/// mesh whose triangles all face inward has the same result: one that encloses a negative volume
/// counts as turned inside out. Parts of a mesh that overlaps itself count with their winding
/// number, which is negative where only a part of it faces inward. A region is a connected part of
/// the common volume. Its surface consists of patches of either mesh that lie inside the other and
/// are joined by curves. A cavity belongs to the region around it, also where it touches the
/// region's outer surface.
///
/// **Errors.** std::invalid_argument if a mesh is not closed (the message names an edge) or a
/// transform is not a rigid motion. The result is then unchanged.
///
/// **Threads.** Thread-safe on shared meshes, as query.h. A query runs on the calling thread. A
/// reused result allocates nothing once it has grown.

/// The part of one mesh's surface that lies inside the other, region by region.
struct ContactPatches {
  std::vector<double> areas;  ///< 0 if the region has no part of this mesh's surface
  /// Centroids of the patches, in the world; for a patch without area a point of it, or the deepest
  /// point.
  std::vector<fcl::Vector3d> centroids;
  /// Triangles with a part in region r, by increasing index: from triangles[begins[r]] up to
  /// triangles[begins[r + 1]], which is excluded. A triangle may be in several regions.
  std::vector<unsigned> triangles;
  std::vector<std::size_t> begins;  ///< one more than there are regions
};

/// Regions and curves, in parallel arrays. Positions and directions are in the world. Regions
/// are in the order of their smallest triangle of `first`, then of `second`, then of their first
/// curve; those without a triangle of `first` come last.
struct ContactRegions {
  std::vector<double> volumes;  ///< volumes of the regions
  /// Depths: the largest distance of a point of either surface inside the other body to the other's
  /// surface. The candidates are the vertices that are inside, and the centroids of all triangles'
  /// parts. So a depth is never too large, and too small by at most the longest edge of these
  /// triangles.
  std::vector<double> depths;
  std::vector<fcl::Vector3d> deepest_points;  ///< points with these depths
  /// Mean normals, of length 1, from `first` to `second`: the mean of the outward normals of the
  /// first's patches and of the inward normals of the second's, weighted by area. Both parts are
  /// equal, because the patches together are closed. Faces of the two meshes that coincide, up to
  /// the rounding of positions, do not count; so flush side walls do not tilt the normal, and with
  /// `first` and `second` exchanged it is the opposite. In a region without volume, where bodies
  /// only touch, the faces that touch count. Zero if all cancel each other, for example for a body
  /// that lies wholly inside the other.
  std::vector<fcl::Vector3d> normals;
  ContactPatches first;   ///< the parts of the first surface inside the second body
  ContactPatches second;  ///< the parts of the second surface inside the first body

  /// The points of all curves, at which an edge of one mesh crosses a triangle of the other. Two
  /// consecutive points may be equal. All curves are closed: the last point of each is joined with
  /// its first. Seen from outside of `first`, its part inside `second` is to the left.
  std::vector<fcl::Vector3d> curve_points;
  /// The triangle of the first mesh on which the segment from each point to the next lies.
  std::vector<unsigned> curve_first;
  std::vector<unsigned> curve_second;  ///< the triangle of the second mesh with that segment
  /// Curve c has the points from curve_begins[c] up to curve_begins[c + 1], which is excluded.
  std::vector<std::size_t> curve_begins;
  /// The region of each curve. Curves are ordered by region, and begin with the smallest pair of
  /// triangles (first, second).
  std::vector<unsigned> curve_regions;

  /// The number of regions.
  std::size_t size() const { return volumes.size(); }
  /// The number of curves.
  std::size_t numCurves() const { return curve_regions.size(); }
};

/// Finds the regions in which two closed meshes overlap. `result` is overwritten. Returns the
/// number of regions.
std::size_t contactRegions(const DeformableMesh& first, const fcl::Transform3d& tf1,
                           const DeformableMesh& second, const fcl::Transform3d& tf2,
                           ContactRegions& result);

/// Change of a region since the last step.
enum class ContactChange {
  Born,        ///< it shares no triangle with a region of the last step
  Persisting,  ///< it continues the region of the last step that shares most triangles with it
  Split,       ///< it is a new part of the region `other`, which is continued by another region
  Merged,      ///< it has become a part of the region `other`
  Gone,        ///< no region shares a triangle with it
};

/// A change of one region.
struct ContactEvent {
  ContactChange change;  ///< kind of the change
  std::uint64_t id;      ///< identity of the region
  std::uint64_t other;   ///< the region that it was split from or merged into; else its own
};

/// Gives the regions of one pair of meshes an identity over many steps, by the triangles of either
/// mesh that they share with the regions of the last step. Old and new regions are matched
/// greedily: first the pair that shares the most triangles; among equal ones the one with the
/// smallest identity, then the one with the smallest new region. A new region without a match is
/// `Split` from the old one with which it shares most, or else `Born`; an old region without a
/// match is `Merged` into the new one with which it shares most, or else `Gone`. Regions should
/// share several triangles from step to step: a region that leaves all its triangles in one step
/// gets a new identity. A reused tracker allocates nothing once it has grown.
class ContactTracker {
 public:
  /// Matches the regions of the next step. If it throws std::bad_alloc, the tracker is as before.
  void track(const ContactRegions& regions) {
    begin(regions.size());
    addSide(0, regions.first.triangles, regions.first.begins);
    addSide(1, regions.second.triangles, regions.second.begins);
    finish();
  }
  /// Forgets all regions; identities are not used again.
  void clear() {
    ids_.clear();
    events_.clear();
    uses_.clear();
  }

  /// Identities of the regions of the last step, in their order, counted from 1.
  const std::vector<std::uint64_t>& ids() const { return ids_; }
  /// Events of the last step: one for each region, in their order, and then one for each region
  /// that has ended, by increasing identity.
  const std::vector<ContactEvent>& events() const { return events_; }

 private:
  /// A region, and a triangle that it has a part of.
  struct Use {
    std::uint64_t triangle;  ///< twice its index, and 1 more of the second mesh
    std::size_t region;
  };
  /// How many triangles an old and a new region share.
  struct Share {
    std::size_t before, now, count;
  };

  void begin(std::size_t regions);
  void addSide(unsigned side, const std::vector<unsigned>& triangles,
               const std::vector<std::size_t>& begins);
  void finish();
  void countShares();
  void matchRegions();
  void reportRegions();
  void reportEnded();

  std::uint64_t last_id_ = 0;
  // Of the last step, and of the one that is being matched with it.
  std::vector<std::uint64_t> ids_, next_ids_;
  std::vector<ContactEvent> events_, next_events_;
  std::vector<Use> uses_, next_uses_;
  std::vector<Share> shares_;
  std::vector<char> is_continued_;  ///< by region of the last step
};

}  // namespace adaptive_bvh
