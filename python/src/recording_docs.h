#pragma once

namespace adaptive_bvh::python::docs {

inline constexpr const char* kRecording =
    R"(Records a run and writes it as one HTML page that plays it, in any browser, without a network.

Add the bodies, call frame() after every step, then write(). A body's positions are kept in 16 bits
of the box around it, about 6 bytes a vertex and frame. It keeps the meshes alive. For one thread at
a time.)";

inline constexpr const char* kRecordingInit =
    R"(title: of the page. unit: of lengths, shown after them, such as 'mm'.
frames_per_second: at which the page plays. up: (3,), which way is up in the world.)";

inline constexpr const char* kRecordingAdd =
    R"(Adds a body, placed by a pose, from the next frame on. Returns its number: 0, 1, ...

body: a DeformableMesh, or an object with `vertices` and `faces` that does not deform, such as a
    Mesh.)";

inline constexpr const char* kRecordingFrame =
    R"(Records the bodies as they are now, with what was computed.

distance: a DistanceResult. contacts: Contacts, of collide or self_collide.
update_ms, query_ms: what updates and queries of this frame took, milliseconds.
clearance: a dict from a body's number to (N,) numbers, one a vertex, to be painted on it.
note: shown with the frame.)";

}  // namespace adaptive_bvh::python::docs
