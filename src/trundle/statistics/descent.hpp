#pragma once

#include <optional>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

/// How a search for a minimum ended.
struct Descent {
  bool converged = false;
  int iterations = 0;      ///< linear systems that were solved
  double last_step = 0.0;  ///< in sigmas of the estimate
  int parameter = -1;      ///< that moved farthest in it; none: −1
};

struct DescentOptions {
  int most_iterations = 100;
  double converged =
      0.01;  ///< a step of fewer sigmas ends the search; its square is what χ² would still gain
};

/// The step to the minimum of a linearised problem.
struct NewtonStep {
  double sigmas = 0.0;  ///< its length by the information matrix N, √(δᵀ N δ)
  int parameter = -1;   ///< that moves farthest; none: −1
};

/// Damped least squares [Nocedal & Wright 2006, ch. 10] of a problem that knows where it is, and has
///   std::optional<NewtonStep> solve();  the step from there; nothing: the linear system is singular
///   bool advance();                     takes that step, or a part of it; false: χ² would grow
///   bool damp();                        makes the next step from there shorter; false: it is as short as can
///   be
template <class Problem>
Descent descend(Problem& problem, const DescentOptions& options) {
  Descent descent;
  while (descent.iterations < options.most_iterations) {
    ++descent.iterations;
    if (const std::optional<NewtonStep> step = problem.solve()) {
      descent.last_step = step->sigmas;
      descent.parameter = step->parameter;
      descent.converged = step->sigmas < options.converged;
      if (descent.converged) break;
      if (problem.advance()) continue;
    }
    if (!problem.damp()) break;
  }
  return descent;
}

}  // namespace trundle::statistics
