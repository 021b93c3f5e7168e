#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include <fcl/common/types.h>
#include <fcl/math/triangle.h>

#ifdef ADAPTIVE_BVH_HAS_RECORDING
#include "adaptive_bvh/recording.h"
#endif

/// `--page FILE` for the numbered examples: their run as a page that plays it. Without that option
/// no call does anything. (adaptive_bvh/recording.h is all that your own program needs.)
class Page {
 public:
  Page(int argc, char** argv, const char* title, const char* unit = "") {
    for (int i = 1; i + 1 < argc; ++i)
      if (std::string(argv[i]) == "--page") path_ = argv[i + 1];
#ifdef ADAPTIVE_BVH_HAS_RECORDING
    adaptive_bvh::RecordingOptions options;
    options.title = title;
    options.unit = unit;
    options.frames_per_second = 8;
    recording_ = adaptive_bvh::Recording(options);
#else
    static_cast<void>(title);
    static_cast<void>(unit);
    if (wanted()) std::puts("built without the component recording (libjs-three): no page");
#endif
  }
  bool wanted() const { return !path_.empty(); }

#ifdef ADAPTIVE_BVH_HAS_RECORDING
  template <typename Body>
  int add(const Body& body, const fcl::Transform3d& tf, const char* name) {
    return wanted() ? recording_.add(body, tf, name) : 0;
  }
  template <typename Scene>
  void follow(const Scene& scene) {
    if (wanted()) recording_.follow(scene);
  }
  /// What the next frame shows beside the bodies.
  void paint(int body, const std::vector<double>& clearance) {
    if (wanted()) next_.addVertexDistances(body, clearance);
  }
  void arrows(const char* label, const std::vector<fcl::Vector3d>& origins,
              const std::vector<fcl::Vector3d>& vectors, double scale = 0) {
    if (wanted()) next_.addArrows(label, origins, vectors, scale);
  }
  /// Colours the triangles whose corners are all among these vertices, by increasing index.
  void colour(int body, const std::vector<fcl::Triangle>& triangles,
              const std::vector<unsigned>& vertices) {
    if (!wanted()) return;
    const auto has = [&](std::size_t v) {
      return std::binary_search(vertices.begin(), vertices.end(), v);
    };
    adaptive_bvh::TrianglePatches found{body, {}, {}};
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if (has(triangles[t][0]) && has(triangles[t][1]) && has(triangles[t][2]))
        found.triangles.push_back(static_cast<unsigned>(t));
    found.patches.assign(found.triangles.size(), 0);
    next_.patches.push_back(found);
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
  void follow(const Any&...) {}
  template <typename... Any>
  void arrows(const Any&...) {}
  template <typename... Any>
  void colour(const Any&...) {}
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
