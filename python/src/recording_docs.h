#pragma once

namespace adaptive_bvh::python::docs {

inline constexpr const char* kRecording =
    R"(Records a run and writes it as one HTML page that plays it, in any browser, without a network.

Add the bodies or follow a scene, call frame() after every step, then write(). A body's positions are
kept in 16 bits of the box around it, about 6 bytes a vertex and frame. The recording keeps meshes and
the scene alive. It reads them as a query does, and changes nothing in them.

The page shows the times that frame() is given; nothing is measured here. frame() itself replaces what
the processor's caches hold, so the next update may take longer. For times without that, let the run
pass once without a recording, keep the times of its steps, and hand them over in a second run.

Thread-safe: threads take turns.)";

inline constexpr const char* kRecordingInit =
    R"(title: of the page. unit: of lengths, shown after them, such as 'mm'.
frames_per_second: at which the page plays. up: (3,), which way is up in the world.)";

inline constexpr const char* kRecordingAdd =
    R"(Adds a body, placed by a pose, from the next frame on. Returns its number: 0, 1, ...

body: a DeformableMesh; a Shape; or an object with `vertices` and `faces` that does not deform, such
    as a Mesh, which is copied. Planes and half-spaces are drawn as a square.
name: of the body on the page.)";

inline constexpr const char* kRecordingRemove =
    R"(Takes a body out from the next frame on. Its number is never given again. ValueError when there is
no such body, and for one of a followed scene: that leaves the recording when it leaves the scene.)";

inline constexpr const char* kRecordingFollow =
    R"(Records the bodies of a Scene with their poses: frame() adds bodies that are new in the scene and
removes bodies that have left it. RuntimeError when a scene is followed already.

name: a function that returns a body's name on the page, name(body) for its number in the scene; None
    names them 'body 7'. It must not call the scene, the recording or a mesh: RuntimeError. What it
    raises, follow(), frame() and body_of() raise, and record nothing.)";

inline constexpr const char* kRecordingBodyOf =
    R"(The number in this recording of a body of the followed scene, for `clearance` and `patches` of
frame(). ValueError when no scene with such a body is followed.)";

inline constexpr const char* kRecordingFrame =
    R"(Records the bodies as they are now, with what was computed. All arguments may be left out. Points
and vectors are in the world, lengths in the bodies' unit.

distance: a DistanceResult, a SceneDistance or a number, shown as the frame's distance; the nearest
    points are joined by a segment. A list of these shows the smallest distance and all segments.
contacts: Contacts, SceneCollisions or an array of (K, 3) points; or a list of these.
update_ms, query_ms: what updates and queries of this frame took, milliseconds. The page shows these
    numbers, such as 1e3 * mesh.last_update.seconds.
nearest_points: (K, 2, 3), more pairs of points that segments join.
clearance: a dict from a body's number to (N,) numbers, one a vertex, to be painted on it.
arrows: a dict from a label, such as 'contact force, N', to (origins, vectors) or (origins, vectors,
    scale), (K, 3) each. `scale` is the drawn length of a vector of length 1; 0, or none, draws the
    label's longest vector of the run as long as an eighth of the scene.
segments: a dict from a label to (K, 2, 3), both ends of each, such as FeatureDetails.nearest_points.
patches: a dict from a body's number to the triangles of it that are coloured: ContactPatches, which
    is `first` or `second` of ContactRegions, each region in a colour of its own; (ContactPatches,
    ids) with ContactTracker.ids, by which a region keeps its colour; or (triangles, numbers), (K,)
    indices and the number of a patch for each. Equal numbers get equal colours.
note: shown with the frame.

TypeError, ValueError or IndexError on other objects, wrong shapes, numbers that are not finite, and
bodies or triangles that are not there: nothing is recorded then. Points of results that were not
computed (NaN) are left out.)";

inline constexpr const char* kRecordingWrite =
    R"(Writes the page: one file of about 0.9 megabytes and 4/3 of num_bytes.

path: a string, bytes or a path object. RuntimeError, which says why, when it cannot be written, and
when no frame was recorded.)";

inline constexpr const char* kRecordingHtml =
    R"(The page as a string, as write() writes it: for a notebook or a server. RuntimeError when no frame
was recorded.)";

}  // namespace adaptive_bvh::python::docs
