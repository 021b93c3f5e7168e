#include "hierarchy/fcl_hooks.h"

#include <fcl/geometry/bvh/detail/BV_splitter.h>

#include "volume/rss.h"

namespace adaptive_bvh {
namespace {

template <typename BV>
class Fitter final : public fcl::detail::BVFitterBase<BV> {
 public:
  using S = typename BV::S;

  void set(fcl::Vector3<S>* vertices, fcl::Triangle* triangles, fcl::BVHModelType type) override {
    set(vertices, nullptr, triangles, type);
  }

  void set(fcl::Vector3<S>* vertices, fcl::Vector3<S>* previous, fcl::Triangle* triangles,
           fcl::BVHModelType type) override {
    mesh().vertices = vertices;
    mesh().previous = previous;
    mesh().triangles = type == fcl::BVH_MODEL_TRIANGLES ? triangles : nullptr;
  }

  BV fit(unsigned int* primitives, int count) override {
    return Volume<BV>::fit(mesh(), primitives, count);
  }

  void clear() override { mesh() = MeshView<S>(); }

 private:
  static MeshView<S>& mesh() {
    static thread_local MeshView<S> view;
    return view;
  }
};

/// FCL's own rule, one instance per thread.
template <typename BV>
class Splitter final : public fcl::detail::BVSplitterBase<BV> {
 public:
  using S = typename BV::S;

  void set(fcl::Vector3<S>* vertices, fcl::Triangle* triangles, fcl::BVHModelType type) override {
    rule().set(vertices, triangles, type);
  }
  void computeRule(const BV& bv, unsigned int* primitives, int count) override {
    rule().computeRule(bv, primitives, count);
  }
  bool apply(const fcl::Vector3<S>& q) const override { return rule().apply(q); }
  void clear() override { rule().clear(); }

 private:
  using Rule = fcl::detail::BVSplitter<BV>;
  static Rule& rule() {
    static thread_local Rule mean_split(fcl::detail::SPLIT_METHOD_MEAN);
    return mean_split;
  }
};

}  // namespace

template <typename BV>
std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter() {
  static const auto fitter = std::make_shared<Fitter<BV>>();
  return fitter;
}

template <typename BV>
std::shared_ptr<fcl::detail::BVSplitterBase<BV>> sharedSplitter() {
  static const auto splitter = std::make_shared<Splitter<BV>>();
  return splitter;
}

template std::shared_ptr<fcl::detail::BVFitterBase<fcl::RSS<float>>> sharedFitter();
template std::shared_ptr<fcl::detail::BVFitterBase<fcl::RSS<double>>> sharedFitter();
template std::shared_ptr<fcl::detail::BVSplitterBase<fcl::RSS<float>>> sharedSplitter();
template std::shared_ptr<fcl::detail::BVSplitterBase<fcl::RSS<double>>> sharedSplitter();

}  // namespace adaptive_bvh
