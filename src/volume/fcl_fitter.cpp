#include "volume/fcl_fitter.h"

#include "volume/each_volume.h"
#include "volume/volume.h"

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

}  // namespace

template <typename BV>
std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter() {
  static const auto fitter = std::make_shared<Fitter<BV>>();
  return fitter;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) \
  template std::shared_ptr<fcl::detail::BVFitterBase<BV>> sharedFitter();
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
