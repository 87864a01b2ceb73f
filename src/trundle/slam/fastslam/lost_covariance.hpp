#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/landmark_columns.hpp"

namespace trundle::slam {

/// Of where a submap lies in the world.
struct FrameCovariance {
  Vector2 centre = Vector2::Zero();
  Matrix3 covariance = Matrix3::Zero();  ///< of a shift along x and y and a turn about the centre

  [[nodiscard]] FrameCovariance about(const Vector2& other) const;
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.centre, self.covariance);
  }
};

/// Enough to tell a shift from a turn; more would cost time and change nothing.
inline constexpr std::size_t kLandmarksOfScatter = 4;

/// Where particles have a landmark of older columns, `ancestors` saying whose numbers each has: as many as
/// will do, spread over all of them. Empty when one of those does not have it.
[[nodiscard]] std::vector<Vector2> some_places(const LandmarkColumns& columns,
                                               std::span<const Ancestry::Index> ancestors,
                                               std::size_t particles);

/// What particles of equal weight differ in, from the places of landmarks by particle: eq. 60. With fewer
/// than two there is no map to speak of.
[[nodiscard]] std::optional<FrameCovariance> map_scatter(std::span<const std::vector<Vector2>> landmarks);

/// How fast the ancestries of particles coalesce. The weights of one resampling would show less of it:
/// families that do well go on doing well, and take with them whatever else they are.
class Coalescence {
 public:
  explicit Coalescence(std::size_t particles);

  /// A resampling is near.
  void hold(Ancestry& ancestry);
  /// After it: the share that it has taken of the variance of whatever sightings do not show. Eq. 61.
  double share_lost(Ancestry& ancestry);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.epochs_);
  }

 private:
  std::size_t lag_;                      ///< resamplings over which families are counted
  std::vector<Ancestry::Epoch> epochs_;  ///< held, the oldest first
};

/// Covariance D of the map frame that resampling has taken from the particles. Each resampling makes them
/// more alike, also in what sightings do not show: where the map that is in view lies in the world. Their
/// error in it remains, so its covariance is kept here. docs/theory/resampling.md, eq. 60 to 62 and 68 to 70.
class LostCovariance {
 public:
  /// Where a landmark is seen, how far from there it is mapped, and the covariance of that.
  struct Fit {
    Vector2 seen;
    Vector2 residual;
    Matrix2 covariance;
  };

  /// A resampling has taken `share` of what particles differed in, and left this scatter. Returns the total
  /// V, which resampling does not change.
  FrameCovariance after_resampling(const FrameCovariance& scatter, double share);

  /// V = D + G: what is lost, and what particles still differ in, after the last resampling.
  [[nodiscard]] const FrameCovariance& total() const { return total_; }
  /// Adds what no sighting has shown. Eq. 70.
  void inflate(const FrameCovariance& more);
  /// A landmark of a submap whose frame had the covariance `old` fits. Eq. 68.
  void update(const FrameCovariance& old, const Fit& fit);
  /// The particles follow a submap whose frame has the covariance `old`: theirs is no less. Eq. 69.
  void inflate_to(const FrameCovariance& old, const Vector2& centre);
  /// A loop has been closed: D and V from then on.
  void reset(const FrameCovariance& lost, const FrameCovariance& total);

  /// What belongs to the scatter of the particles' poses, beyond what it is: covariance of (x, y, heading) in
  /// world axes of a body at `position`.
  [[nodiscard]] Matrix3 beyond_scatter(const Vector2& position) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.lost_, self.total_);
  }

 private:
  FrameCovariance lost_;   ///< D
  FrameCovariance total_;  ///< V
};

/// The same of a landmark that was last in view when the total covariance of its place was this.
[[nodiscard]] Matrix2 beyond_scatter(const Matrix2& total, const Matrix2& scatter);

}  // namespace trundle::slam
