// Must not compile, and say why in one sentence: see CMakeLists.txt.
#include "adaptive_bvh/adaptive_bvh_model.h"

adaptive_bvh::AdaptiveBVHModel<VOLUME> model;
