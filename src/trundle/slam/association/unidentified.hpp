#pragma once

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/association/joint_compatibility.hpp"
#include "trundle/slam/association/landmark_grid.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// The sightings of one instant that have no id, and what of a map they may show: how filters whose map is
/// one Gaussian associate them. docs/theory/association.md, eq. 21, 22.
class UnidentifiedSightings {
 public:
  /// `gate`: of one sighting's NIS, at which all of them are judged together.
  UnidentifiedSightings(const LandmarkSensor& sensor, double gate);

  /// Starts with those of an instant.
  void begin(std::span<const Observation> observations);
  /// Indices of the observations without an id.
  [[nodiscard]] std::span<const std::size_t> observations() const { return observations_; }
  /// For each, the landmarks near where it points from the body; `moved_m`: how far from the grid's places
  /// they may be by now.
  [[nodiscard]] std::vector<std::vector<std::size_t>> candidates(const PoseEstimate& body,
                                                                 const LandmarkGrid& grid,
                                                                 double moved_m) const;

  /// The observation numbered k of observations() may show a landmark: (range, bearing) differ by
  /// `innovation`, of covariance S. True: within the gate it may be that one, and is a pairing. Ascending by
  /// k.
  bool consider(std::size_t k, std::size_t landmark, const Vector2& innovation, const Matrix2& S);
  [[nodiscard]] const std::vector<Pairing>& pairings() const { return readings_.pairings; }
  /// The most probable explanation of all together, of the innovations of all pairings and their covariance.
  /// What is neither one of the map nor surely a new one is reported as rejected.
  void decide(Eigen::VectorXd innovation, Eigen::MatrixXd S, StepReport& report);

  /// Which landmark of the map an observation shows (its index, not k); kNone: a new one, or none.
  static constexpr std::int64_t kNone = -1;
  [[nodiscard]] std::int64_t shown_by(std::size_t observation) const { return shown_[observation]; }
  /// That is one which it has created.
  void show(std::size_t observation, std::size_t landmark) {
    shown_[observation] = static_cast<std::int64_t>(landmark);
  }

  /// Landmarks that ought to be seen become less likely where they are not; returned are those that are to
  /// go. `pose`: of the body; `existence`: of a landmark that the grid holds. docs/theory/existence.md,
  /// eq. 23.
  std::vector<std::size_t> update_existence(const Pose2& pose, const StepReport& report,
                                            const LandmarkGrid& grid, Visibility& visibility,
                                            const std::function<Existence&(std::size_t)>& existence) const;

 private:
  /// The landmark that comes nearest to a sighting.
  struct Nearest {
    Vector2 innovation = Vector2::Zero();  ///< (range, bearing) [m, rad]
    double nis = std::numeric_limits<double>::infinity();
    bool is_ambiguous = false;  ///< too near to a landmark of the map for a new one, yet not matched
  };
  void mark_ambiguous(const JointExplanation& explanation);

  LandmarkSensor sensor_;
  AssociationOptions options_;
  std::vector<double> joint_limits_;  ///< on the NIS of so many matches together
  double least_;                      ///< −2 log density of a reading at its most
  double none_;                       ///< and of one that shows nothing of the map
  std::span<const Observation> all_;
  std::vector<std::size_t> observations_;
  std::vector<Nearest> nearest_;  ///< by k
  JointReadings readings_;        ///< pairings that pass the gate alone
  std::vector<std::int64_t> shown_;
};

}  // namespace trundle::slam
