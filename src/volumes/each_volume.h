#pragma once

#include <fcl/math/bv/OBBRSS.h>
#include <fcl/math/bv/RSS.h>

/// Hands every type of bounding volume that the library is compiled for to a macro, for explicit
/// instantiation.
#define ADAPTIVE_BVH_FOR_EACH_VOLUME(macro)                                \
  macro(fcl::RSS<float>) macro(fcl::RSS<double>) macro(fcl::OBBRSS<float>) \
      macro(fcl::OBBRSS<double>)
