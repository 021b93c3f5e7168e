#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include <fcl/geometry/geometric_shape_to_BVH_model.h>

#ifdef ADAPTIVE_BVH_HAS_RECORDING
#include "adaptive_bvh/recording.h"
#endif

/// `--page FILE` for the numbered examples: their run as a page that plays it. Without that option
/// no call does anything. (adaptive_bvh/recording.h is all that your own program needs.)
class Page {
 public:
  Page(int argc, char** argv, const char* title) {
    for (int i = 1; i + 1 < argc; ++i)
      if (std::string(argv[i]) == "--page") path_ = argv[i + 1];
#ifdef ADAPTIVE_BVH_HAS_RECORDING
    adaptive_bvh::RecordingOptions options;
    options.title = title;
    options.frames_per_second = 8;
    recording_ = adaptive_bvh::Recording(options);
#else
    static_cast<void>(title);
    if (wanted()) std::puts("built without the component recording (libjs-three): no page");
#endif
  }
  bool wanted() const { return !path_.empty(); }

#ifdef ADAPTIVE_BVH_HAS_RECORDING
  template <typename Body>
  int add(const Body& body, const fcl::Transform3d& tf, const char* name) {
    return wanted() ? recording_.add(body, tf, name) : 0;
  }
  /// A shape of FCL's, as `fineness` triangles show it.
  template <typename Shape, typename... Fineness>
  void addShape(const Shape& shape, const fcl::Transform3d& tf, const char* name,
                Fineness... fineness) {
    fcl::BVHModel<fcl::RSSd> model;
    fcl::generateBVHModel(model, shape, fcl::Transform3d(fcl::Transform3d::Identity()),
                          fineness...);
    add(adaptive_bvh::TriangleMesh<double>{{model.vertices, model.vertices + model.num_vertices},
                                           {model.tri_indices, model.tri_indices + model.num_tris}},
        tf, name);
  }
  /// What the next frame shows beside the bodies.
  void paint(int body, const std::vector<double>& clearance) {
    if (wanted()) next_.addClearance(body, clearance);
  }
  void note(const std::string& text) { next_.note = text; }
  template <typename... Results>
  void frame(const Results&... results) {
    if (!wanted()) return;
    (next_.add(results), ...);
    recording_.frame(next_);
    next_ = {};
  }
  void write() {
    if (!wanted()) return;
    recording_.write(path_);
    std::printf("page: %s\n", path_.c_str());
  }

 private:
  adaptive_bvh::Recording recording_;
  adaptive_bvh::FrameResults next_;
#else
  template <typename... Any>
  int add(const Any&...) {
    return 0;
  }
  template <typename... Any>
  void addShape(const Any&...) {}
  template <typename... Any>
  void paint(const Any&...) {}
  template <typename... Any>
  void note(const Any&...) {}
  template <typename... Any>
  void frame(const Any&...) {}
  void write() {}

 private:
#endif
  std::string path_;
};
