#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/landmark_columns.hpp"

namespace trundle::slam {

/// Of where a piece of the map lies.
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

/// How fast particles become kin. Chance alone, of a resampling, would tell less: families that do well go on
/// doing well, and take with them whatever else they are.
class Coalescence {
 public:
  explicit Coalescence(std::size_t particles);

  /// A resampling is near.
  void hold(Ancestry& ancestry);
  /// After it: the share that it has taken of the variance of whatever sightings do not tell. Eq. 61.
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

/// What particles differed in, and forgot. Each resampling makes them more alike, also in what sightings do
/// not tell: where the map that is in view lies in the world. The particles lose that doubt, the truth does
/// not; here it is kept. docs/theory/resampling.md, eq. 60 to 62 and 68 to 70.
class LostCovariance {
 public:
  /// Where a landmark is seen, how far from there it is mapped, and the covariance of that.
  struct Fit {
    Vector2 seen;
    Vector2 apart;
    Matrix2 errors;
  };

  /// A resampling has taken `share` of what particles differed in, and left the scatter. Returns what they
  /// differ in and have forgotten, together: resampling does not change that.
  FrameCovariance forget(const FrameCovariance& left, double share);

  /// The same, as it was after the last resampling.
  [[nodiscard]] const FrameCovariance& whole() const { return whole_; }
  /// More, that sightings have not told. Eq. 70.
  void keep(const FrameCovariance& more);
  /// A landmark of a piece of the map that was in `old` doubt fits. Eq. 68.
  void recall(const FrameCovariance& old, const Fit& fit);
  /// The particles follow a piece of the map that is in `old` doubt; what follows is in as much. Eq. 69.
  void be_no_surer_than(const FrameCovariance& old, const Vector2& centre);
  /// A loop has been closed: what is forgotten then, and what that is with what particles differ in.
  void remember(const FrameCovariance& forgotten, const FrameCovariance& whole);

  /// What belongs to the scatter of the particles' poses, beyond what it is: covariance of (x, y, heading) in
  /// world axes of a body at `position`.
  [[nodiscard]] Matrix3 beyond_scatter(const Vector2& position) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.lost_, self.whole_);
  }

 private:
  FrameCovariance lost_;
  FrameCovariance whole_;
};

/// The same of a landmark that has not been in view since its place was in `whole` doubt.
[[nodiscard]] Matrix2 beyond_scatter(const Matrix2& whole, const Matrix2& scatter);

}  // namespace trundle::slam
