#pragma once

#include "trundle/evaluation/evaluate.hpp"

namespace trundle::evaluation {

/// Throws CannotAnswer, in words, where fewer than two stamps are covered.
void demand_overlap(const std::vector<PosePair>& pairs, const Trajectory& estimate,
                    const Trajectory& reference, double longest_gap_s);

/// The motion that `alignment` applies to the estimates. Throws as evaluate().
[[nodiscard]] Pose2 alignment_of(const std::vector<PosePair>& pairs, Alignment alignment);

/// Applies it to the estimates, and to the covariances' axes.
[[nodiscard]] std::vector<PosePair> aligned(std::vector<PosePair> pairs,
                                            const Pose2& reference_from_estimate);

/// The pairs as their errors are judged: in the reference's frame; with Alignment::start with the covariances
/// of the motion since the first pair; and with what the reference itself is known to.
[[nodiscard]] std::vector<PosePair> judged(const std::vector<PosePair>& pairs,
                                           const Pose2& reference_from_estimate,
                                           const EvaluateOptions& options);

/// The first pair at which the estimate has moved since the first of all; pairs.size() where it never does.
[[nodiscard]] std::size_t first_moved(const std::vector<PosePair>& pairs, const EvaluateOptions& options);

/// Replaces covariances by those of the motion since the first pair, for independent increments:
/// Σ_δ = Σ_k − Ad(δ⁻¹) Σ_0 Ad(δ⁻¹)ᵀ in the body frame, δ the motion.
void start_covariances_from_zero(std::vector<PosePair>& pairs);

}  // namespace trundle::evaluation
