#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>

#include "trundle/slam/fastslam/loop_correction.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// A landmark that was last seen long ago, and where it is seen now.
struct Revisit {
  LandmarkId landmark = kUnknownLandmark;
  Vector2 seen = Vector2::Zero();             ///< in the world, from where the robot is taken to be
  Matrix2 seen_covariance = Matrix2::Zero();  ///< of the reading
  Vector2 mapped = Vector2::Zero();           ///< where the map has it
  Matrix2 mapped_covariance = Matrix2::Zero();
  Submap seen_in = {};                  ///< that in view when it was last seen
  Vector2 seen_from = Vector2::Zero();  ///< where the robot is taken to be

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.landmark, self.seen, self.seen_covariance, self.mapped, self.mapped_covariance, self.seen_in,
            self.seen_from);
  }
};

/// The move that takes what is seen to where it is mapped, most probably: `prior` is the covariance of its
/// twist about the centre, before anything is seen. docs/theory/loop-closing.md, eq. 64.
[[nodiscard]] LoopCorrection::Move rigid_fit(std::span<const Revisit> again, const Vector2& centre,
                                             const Matrix3& prior);

/// Landmarks that are rejected although the map's doubt explains where they are seen, until they are enough
/// to tell by what move it does. docs/theory/loop-closing.md.
class LoopClosing {
 public:
  /// A step with sightings has come.
  void next_keyframe();
  /// Its number.
  [[nodiscard]] std::uint64_t keyframe() const { return keyframe_; }
  /// Whether it was not in view lately.
  [[nodiscard]] bool is_old(const Submap& piece) const;
  /// A rejected sighting of a landmark of old.
  void rejected(const Revisit& again, const Submap& now);
  /// One that fits: the loop is closed already, or what is rejected is wrong.
  void matched(const Revisit& again, const Submap& now);
  /// A landmark fits that was in view lately: if it had come back, it is still there.
  void still_matched(LandmarkId landmark);
  /// Whether landmarks of old that have come back are where they are mapped, but for a few.
  [[nodiscard]] bool is_closed() const;
  /// Whether this step has rejected one that drift explains.
  [[nodiscard]] bool has_news() const { return is_news_; }
  /// Where what has been rejected lately agrees on one move, the map is to be bent by it; all is forgotten
  /// then.
  std::optional<LoopCorrection> close(const Submap& now);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.window_, self.returned_, self.keyframe_);
  }

 private:
  struct Sighting {
    Revisit again;
    std::uint64_t keyframe = 0;
    bool speaks_for_drift = false;  ///< its doubt explains why it was rejected

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.again, self.keyframe, self.speaks_for_drift);
    }
  };
  [[nodiscard]] bool is_another_look(const Revisit& again) const;
  void remember(const Revisit& again, bool speaks_for_drift);

  /// Landmarks of old that fit, and when they did last.
  std::map<LandmarkId, std::uint64_t> returned_;
  std::deque<Sighting> window_;
  std::uint64_t keyframe_ = 0;
  bool is_news_ = false;  ///< something speaks for a drift in this step
};

}  // namespace trundle::slam
