#pragma once

namespace adaptive_bvh {

/// When a bounding volume counts as unfit and is refitted: the seven logical combinations of the
/// three fitness tests of thesis section 4.5, and the two extremes it compares them with. A name
/// without "Or" is a conjunction: `ABOrBC` reads (A and B) or (B and C).
///
/// - Test A, inflation factor (4.4.1): the volume grew by more than `max_inflation`.
/// - Test B, recent traversal (4.4.2): a recording query (query.h) since the last update went below
///   the node, or tested its triangle.
/// - Test C, child node distances (4.4.3): in such a visit the volume was tested, and both children
///   were so far from the other side that the original volume would have been a better bound than
///   the inflated one. C implies B. Overlap tests compute no distances, so collisions record
///   nothing for C.
///
/// Queries of a DeformableMesh, including that of AdaptiveBVHModel::mesh, record nothing.
///
/// If no query recorded since the last update, B is true for every node, and C is false.
///
/// A step that moves no vertex is judged, too, unless the criterion is A or RefitNone: by these it
/// refits nothing.
enum class FitnessCriterion {
  A,          ///< thesis i, the default
  B,          ///< thesis ii; also how the thesis models Larsson and Akenine-Moeller (2006)
  AB,         ///< thesis iii
  BC,         ///< thesis iv
  ABC,        ///< thesis v
  AOrBC,      ///< thesis vi
  ABOrBC,     ///< thesis vii, the best of Table 2
  RefitAll,   ///< every node, every step: what FCL's top-down refit does
  RefitNone,  ///< never: nodes only inflate
};

/// How an update keeps a volume that it does not refit around its moving triangles.
enum class Propagation {
  /// Every volume is moved by the middle of its vertices' displacements and grows by what remains:
  /// a part that moves as a whole does not grow.
  TranslationCompensated,
  /// Thesis 4.3: every volume stays where it is and grows by the largest displacement. Keeps the
  /// displacements of 4.2.
  Displacements,
};

/// The length that an inflation (current radius - original radius) is compared with.
enum class InflationReference {
  /// Original radius plus half the rectangle's shorter side; the longer side where both are zero.
  /// A length of the whole volume: it stays meaningful for flat parts, whose radius is only the
  /// rounding term.
  NodeSize,
  /// The thesis's measure (4.4.1): the original radius alone. The volume of a single triangle, or
  /// of any flat part, has a radius of rounding size, so that any motion counts as a huge, yet
  /// finite, inflation there.
  OriginalRadius,
};

/// Decides which bounding volumes an update refits. A plain value: copy it, change it, hand it to
/// AdaptiveBVHModel::setRefitPolicy at any time between two updates.
///
/// Answers are exact with every policy, which only moves work between the update and the query. The
/// defaults measured best on the five scenarios of the thesis and on others, at thesis size and up
/// to 144 times the triangles (docs/experiment.md). A refit is so cheap that the default criterion
/// does not need records of queries. It does not use k and gamma; their defaults are good values
/// for criteria that do. `tune` finds values for your simulation.
struct RefitPolicy {
  /// Which combination of tests marks a node as unfit.
  FitnessCriterion criterion = FitnessCriterion::A;

  /// p_max of test A, a ratio >= 0: unfit when inflation / reference length exceeds it.
  double max_inflation = 0.1;

  /// k of test C, in [0, 1]: both children must be farther off than the parent by more than this
  /// share of the parent's inflation.
  double child_distance_ratio = 0.84;

  /// gamma of test C, a ratio >= 0: test C looks only at nodes inflated by at least this factor.
  double min_inflation = 0.58;

  /// What `max_inflation` and `min_inflation` are ratios of.
  InflationReference reference = InflationReference::NodeSize;

  /// Propagation::TranslationCompensated only. A refit rotates the axes of a volume with its
  /// vertices and recomputes the extents along them, in a fifth of the time of a fit. If the
  /// volume's surface area then exceeds the one at the last choice of axes by more than this ratio,
  /// >= 0, new axes are chosen as well.
  double axes_tolerance = 0.25;

  /// Propagation::Displacements only. A leaf's radius is original + overall displacement. The
  /// thesis (4.3, step 3) only ever raises it. The bound also holds if the radius shrinks when a
  /// vertex moves back.
  bool leaf_radius_may_shrink = true;

  /// How an update keeps volumes sound that it does not refit.
  Propagation propagation = Propagation::TranslationCompensated;

  /// The row of thesis Table 2 for `criterion`, with the thesis's own propagation, inflation
  /// measure and leaf rule. Parameters that a criterion does not use keep their defaults.
  static RefitPolicy thesis(FitnessCriterion criterion);

  /// Throws std::invalid_argument, naming the member, if a parameter is negative or not finite.
  void check() const;
};

/// The criterion as a formula, e.g. "(A and B) or (B and C)"; never null.
const char* toString(FitnessCriterion criterion);

}  // namespace adaptive_bvh
