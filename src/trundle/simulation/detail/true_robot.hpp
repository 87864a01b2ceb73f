#pragma once

#include "trundle/simulation/detail/scenario_keys.hpp"

namespace trundle::simulation::scenario_file {

/// The nominal robot with what [truth] says of it.
Robot read_truth(const Section& file, const Robot& nominal);

/// 1σ of the true robot's numbers from session to session: zero but where [session_spread] names them.
class SessionSpread {
 public:
  SessionSpread(const Section& file, const Robot& nominal);
  /// The robot of one session.
  Robot drawn(const Robot& truth, Random& random) const;

 private:
  Robot sigma_;
  double track_sigma_m_ = 0.0;
};

}  // namespace trundle::simulation::scenario_file
