#pragma once

#include <vector>

#include "trundle/slam/association/existence.hpp"
#include "trundle/slam/association/landmark_grid.hpp"
#include "trundle/slam/ekf/joint_gaussian.hpp"

namespace trundle::slam {

/// What an EKF knows: the joint Gaussian of body and map, and which landmark each of its blocks is.
struct EkfBelief {
  using Index = Eigen::Index;
  static constexpr std::int64_t kNone = -1;  ///< in place of a landmark's number: the map has none

  struct Landmark {
    LandmarkId id = kUnknownLandmark;
    std::size_t sightings = 0;   ///< matched, and the one that created it
    bool is_identified = false;  ///< the caller gave its id: it exists
    Existence existence = {};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.id, self.sightings, self.is_identified, self.existence);
    }
  };

  /// Unidentified landmarks are numbered from `first_unidentified` on; `visibility`: of the sensor.
  EkfBelief(const SlamPrior& prior, LandmarkId first_unidentified, double max_range_m,
            const ExistenceOptions& existence)
      : joint(prior),
        next_unidentified(first_unidentified),
        grid(kCellShare * max_range_m),
        visibility(max_range_m, existence) {}

  JointGaussian joint;
  std::vector<Landmark> landmarks;     ///< in the order of the joint's
  std::vector<std::int64_t> index_of;  ///< by id: the landmark's number, or kNone
  LandmarkId next_unidentified;        ///< id of the next landmark whose sighting has none
  LandmarkGrid grid;                   ///< of the unidentified landmarks
  double off_grid_m = 0.0;             ///< at most so far have they moved since all were put there
  Visibility visibility;

  /// The landmark's number, or kNone.
  [[nodiscard]] std::int64_t find(LandmarkId id) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.joint, self.landmarks, self.index_of, self.next_unidentified, self.grid, self.off_grid_m,
            self.visibility);
  }
};

/// One motion: docs/theory/ekf.md, eq. 5.
void predict(const Motion& motion, EkfBelief& belief);
/// What the gyro reads at rest, after a step.
void read_bias(const BiasReading& reading, EkfBelief& belief);

/// A new landmark, with the id of its sighting or the next one: docs/theory/ekf.md, eq. 8. Returns its
/// number.
std::size_t augment(const Observation& observation, const LandmarkSensor& sensor, EkfBelief& belief);
/// An unidentified landmark goes; the last landmark takes its number.
void remove_landmark(std::size_t landmark, EkfBelief& belief);
/// A landmark's mean has been updated.
void note_moved(std::size_t landmark, EkfBelief& belief);
/// Puts all unidentified landmarks into the grid where they are today.
void refresh_grid(EkfBelief& belief);

}  // namespace trundle::slam
