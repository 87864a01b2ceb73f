#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/smoothing/smoother.hpp"

#include "slam/world.hpp"

namespace trundle::slam {
namespace {

template <typename T>
T wrapped(const T& angle) {
  using std::floor;
  return angle - 2.0 * kPi * floor((angle + kPi) / (2.0 * kPi));
}

/// Log(mean⁻¹ a⁻¹ b) − S p over the odometry's noise, written anew in plain (x, y, heading).
struct OdometryCost {
  Motion motion;
  Matrix3 root;  ///< of the information

  template <typename T>
  bool operator()(const T* a, const T* b, const T* p, T* residual) const {
    using std::cos;
    using std::sin;
    const T dx = b[0] - a[0], dy = b[1] - a[1];
    const T x = cos(a[2]) * dx + sin(a[2]) * dy - motion.mean.x;
    const T y = -sin(a[2]) * dx + cos(a[2]) * dy - motion.mean.y;
    const double c = std::cos(motion.mean.heading), s = std::sin(motion.mean.heading);
    const T tx = c * x + s * y, ty = -s * x + c * y;
    const T turn = wrapped(T(b[2] - a[2] - motion.mean.heading));
    const T half = turn / 2.0;
    const T h = half * half < 1e-12 ? T(1.0) - half * half / 3.0 : half * cos(half) / sin(half);
    Eigen::Matrix<T, 3, 1> e(h * tx + half * ty, h * ty - half * tx, turn);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) e[i] -= motion.by_systematic(i, j) * p[j];
    Eigen::Map<Eigen::Matrix<T, 3, 1>> whitened(residual);
    whitened = root.cast<T>() * e;
    return true;
  }
};

struct SightingCost {
  Observation seen;
  LandmarkSensor sensor;

  template <typename T>
  bool operator()(const T* pose, const T* landmark, T* residual) const {
    using std::atan2;
    using std::cos;
    using std::sin;
    using std::sqrt;
    const Pose2& s = sensor.body_from_sensor;
    const T x = landmark[0] - pose[0] - cos(pose[2]) * s.x + sin(pose[2]) * s.y;
    const T y = landmark[1] - pose[1] - sin(pose[2]) * s.x - cos(pose[2]) * s.y;
    residual[0] = (seen.range_m - sqrt(x * x + y * y)) / sensor.range_sigma_m;
    residual[1] = wrapped(T(seen.bearing_rad - atan2(y, x) + pose[2] + s.heading)) / sensor.bearing_sigma_rad;
    return true;
  }
};

struct PriorCost {
  Systematic sigma;

  template <typename T>
  bool operator()(const T* p, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = p[i] / sigma[i];
    return true;
  }
};

/// docs/theory/smoother.md, eq. 3.
struct Loss : ceres::LossFunction {
  void Evaluate(double s, double out[3]) const override {
    const bool inside = s <= kDefaultGate;
    out[0] = inside ? s : kDefaultGate * (1.0 + std::log(s / kDefaultGate));
    out[1] = inside ? 1.0 : kDefaultGate / s;
    out[2] = inside ? 0.0 : -kDefaultGate / (s * s);
  }
};

/// The same problem for Ceres; values in the order of its steps, from the truth.
class CeresProblem {
 public:
  explicit CeresProblem(const test::SlamWorld& world) {
    for (const Pose2& pose : world.truth) poses_.push_back({pose.x, pose.y, pose.heading});
    for (const Vector2& landmark : world.landmarks) landmarks_.push_back({landmark.x(), landmark.y()});
    using ceres::AutoDiffCostFunction;
    problem_.AddResidualBlock(new AutoDiffCostFunction<PriorCost, 3, 3>(new PriorCost{kUsualShareSigma}),
                              nullptr, p_.data());
    for (std::size_t k = 0; k < world.steps.size(); ++k) {
      const Motion& motion = world.steps[k].motion;
      const Matrix3 information = (motion.covariance + Matrix3::Identity() * 1e-12).inverse();
      const Matrix3 root = information.llt().matrixU();
      problem_.AddResidualBlock(
          new AutoDiffCostFunction<OdometryCost, 3, 3, 3, 3>(new OdometryCost{motion, root}), nullptr,
          k == 0 ? start_.data() : poses_[k - 1].data(), poses_[k].data(), p_.data());
      for (const Observation& seen : world.steps[k].observations)
        problem_.AddResidualBlock(
            new AutoDiffCostFunction<SightingCost, 2, 3, 2>(new SightingCost{seen, world.sensor}), new Loss,
            poses_[k].data(), landmarks_[static_cast<std::size_t>(seen.landmark)].data());
    }
    problem_.SetParameterBlockConstant(start_.data());
  }

  double solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-14;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return 2.0 * summary.final_cost;
  }

  Matrix3 pose_covariance(std::size_t k) { return covariance_of<3>(poses_[k].data()); }
  Matrix2 landmark_covariance(std::size_t i) { return covariance_of<2>(landmarks_[i].data()); }
  Matrix3 systematic_covariance() { return covariance_of<3>(p_.data()); }
  const std::array<double, 3>& pose(std::size_t k) const { return poses_[k]; }
  const std::array<double, 3>& systematic() const { return p_; }

 private:
  template <int Size>
  Eigen::Matrix<double, Size, Size> covariance_of(const double* block) {
    ceres::Covariance covariance({});
    covariance.Compute(std::vector<std::pair<const double*, const double*>>{{block, block}}, &problem_);
    Eigen::Matrix<double, Size, Size, Eigen::RowMajor> result;
    covariance.GetCovarianceBlock(block, block, result.data());
    return result;
  }

  std::array<double, 3> start_{};
  std::array<double, 3> p_{};
  std::vector<std::array<double, 3>> poses_;
  std::vector<std::array<double, 2>> landmarks_;
  ceres::Problem problem_;
};

struct Both {
  test::SlamWorld world;
  SmoothedSlam ours;
};

/// Every fourth step sees; `wrong` of the sightings are far off.
Both smoothed_world(int wrong) {
  Both both{test::slam_world({.steps = 120, .landmarks = 8, .seed = 5, .systematic = {0.02, -0.03, 0.01}}),
            {}};
  for (std::size_t k = 0; k < both.world.steps.size(); ++k) {
    auto& seen = both.world.steps[k].observations;
    if (wrong > 0 && k % 20 == 0 && !seen.empty()) {
      seen.front().range_m += 3.0;
      --wrong;
    }
  }
  SlamInput input;
  input.steps = both.world.steps;
  both.ours = smooth(input, both.world.sensor,
                     slam(input, both.world.sensor, {.method = SlamMethod::fastslam2, .particles = 50}),
                     {.enough = 1e-12});
  return both;
}

TEST(Smoother, HasTheCostAndTheCovariancesThatCeresHas) {
  const Both both = smoothed_world(0);
  CeresProblem theirs(both.world);
  EXPECT_NEAR(both.ours.counts.cost / theirs.solve(), 1.0, 1e-8);
  for (const std::size_t k : {std::size_t{0}, std::size_t{17}, std::size_t{60}, std::size_t{119}}) {
    EXPECT_NEAR(both.ours.trajectory.poses[k].pose.x, theirs.pose(k)[0], 1e-6);
    EXPECT_NEAR(both.ours.trajectory.poses[k].pose.heading, theirs.pose(k)[2], 1e-6);
    const Matrix3 expected = theirs.pose_covariance(k);
    EXPECT_LT((both.ours.trajectory.covariances[k] - expected).norm(), 1e-5 * expected.norm());
  }
  for (const MappedLandmark& landmark : both.ours.map) {
    const Matrix2 expected = theirs.landmark_covariance(static_cast<std::size_t>(landmark.id));
    EXPECT_LT((landmark.covariance - expected).norm(), 1e-5 * expected.norm());
  }
  EXPECT_NEAR(both.ours.last.systematic[1], theirs.systematic()[1], 1e-7);
  const Matrix3 expected = theirs.systematic_covariance();
  EXPECT_LT((both.ours.last.systematic_covariance - expected).norm(), 1e-5 * expected.norm());
}

TEST(Smoother, HasTheCostThatCeresHasWithOutliers) {
  const Both both = smoothed_world(5);
  EXPECT_EQ(both.ours.counts.outliers, 5U);
  EXPECT_NEAR(both.ours.counts.cost / CeresProblem(both.world).solve(), 1.0, 1e-8);
}

}  // namespace
}  // namespace trundle::slam
