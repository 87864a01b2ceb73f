#include "trundle/slam/smoothing/calibration/landmark_noise.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/calibration/lasting_errors.hpp"
#include "trundle/slam/smoothing/calibration/variance_components.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// 1σ of the prior of log σ: a robot file is right within a factor of ten.
constexpr double kPriorSigma = 2.302585092994046;
// 1σ of log σ beyond which a noise is not determined: by two readings it is known to a half.
constexpr double kDeterminedSigma = 0.5;
constexpr double kNoiseSettled = 0.1;  // sigmas of each noise by which a round moves it, at most
constexpr int kMostNewtonSteps = 50;   // each halves the distance at least
constexpr double kMostStep = 0.7;  // of log σ in a round: residuals and weights are those of the round before
constexpr double kDifference = 1e-3;  // of log σ², for a derivative by differences

/// A noise of a robot, as a number that can be set.
struct Noise {
  std::string_view name;
  double (*of)(const Robot&);
  void (*set)(double, Robot&);
  Vector2 of_reading = Vector2::Zero();  ///< a sensor's: of (range, bearing)
};

bool has_skid(const Robot& robot) {
  return has_skid_wheels(robot.chassis);
}

std::vector<Noise> noises_of(const Robot& robot) {
  std::vector<Noise> noises = {
      {"landmark_sensor.range_sigma_m", [](const Robot& r) { return r.landmark_sensor->range_sigma_m; },
       [](double v, Robot& r) { r.landmark_sensor->range_sigma_m = v; }, Vector2::UnitX()},
      {"landmark_sensor.bearing_sigma_deg",
       [](const Robot& r) { return degrees(r.landmark_sensor->bearing_sigma_rad); },
       [](double v, Robot& r) { r.landmark_sensor->bearing_sigma_rad = radians(v); }, Vector2::UnitY()},
      {"noise.wheel_per_sqrt_m", [](const Robot& r) { return typical_wheel_noise(r.chassis); },
       [](double v, Robot& r) { set_typical_wheel_noise(v, r.chassis); }}};
  if (has_sideways(robot) && has_skid(robot))
    noises.push_back({"noise.skid_per_sqrt_m", [](const Robot& r) { return r.chassis.noise.skid_per_sqrt_m; },
                      [](double v, Robot& r) { r.chassis.noise.skid_per_sqrt_m = v; }});
  else if (has_sideways(robot))
    noises.push_back({"noise.lateral_per_sqrt_m",
                      [](const Robot& r) { return r.chassis.noise.lateral_per_sqrt_m; },
                      [](double v, Robot& r) { r.chassis.noise.lateral_per_sqrt_m = v; }});
  if (robot.chassis.gyro)
    noises.push_back({"gyro.noise_rad_s_sqrt_hz",
                      [](const Robot& r) { return r.chassis.gyro->noise_rad_s_sqrt_hz; },
                      [](double v, Robot& r) { r.chassis.gyro->noise_rad_s_sqrt_hz = v; }});
  if (robot.chassis.wheel_count == 0) {
    noises.push_back({"noise.turn_per_sqrt_m", [](const Robot& r) { return r.chassis.noise.turn_per_sqrt_m; },
                      [](double v, Robot& r) { r.chassis.noise.turn_per_sqrt_m = v; }});
    noises.push_back({"noise.turn_per_sqrt_rad",
                      [](const Robot& r) { return r.chassis.noise.turn_per_sqrt_rad; },
                      [](double v, Robot& r) { r.chassis.noise.turn_per_sqrt_rad = v; }});
  }
  std::erase_if(noises, [&](const Noise& noise) { return !(noise.of(robot) > 0.0); });  // said to be none
  return noises;
}

std::vector<Matrix3> covariances_of(const JointProblem& joint) {
  std::vector<Matrix3> covariances;
  for (const Track& track : joint.tracks)
    for (std::size_t k = 0; k < track.keyframes(); ++k) covariances.push_back(track.motion_to(k).covariance);
  return covariances;
}

/// The search for the noises of one set of recordings.
class NoiseSearch {
 public:
  NoiseSearch(std::span<const AssociatedRecording> all, const LandmarkFit& fit, const Robot& given)
      : all_(all),
        free_(fit.free),
        robot_(fit.estimate.robot),
        noises_(noises_of(given)),
        is_sought_(noises_.size(), true),
        state_(fit.state),
        joint_(joint_problem(all, robot_, free_)),
        minimiser_(joint_.problem) {
    for (const Noise& noise : noises_) given_.push_back(noise.of(given));
  }

  LandmarkNoise found() {
    for (int round = 0; round < kMostNewtonSteps; ++round)
      if (step() < kNoiseSettled && !drop_least_determined()) break;
    LandmarkNoise result{.robot = robot_, .levels = {}, .lasting = {}};
    for (std::size_t c = 0; c < noises_.size(); ++c) {
      const double value = noises_[c].of(robot_);
      const auto row = static_cast<Index>(c);
      result.levels.push_back({std::string(noises_[c].name), given_[c], value, value * sigma_[row],
                               redundancy_[row], is_sought_[c]});
    }
    result.lasting = lasting_errors(joint_, state_);
    return result;
  }

 private:
  /// By the variance, not its root: D = ∂V/∂ log σ².
  std::vector<NoiseDerivative> derivatives() const {
    const std::vector<Matrix3> here = covariances_of(joint_);
    std::vector<NoiseDerivative> all;
    for (const Noise& noise : noises_) {
      NoiseDerivative derivative{.of_reading = noise.of_reading};
      if (noise.of_reading.isZero()) {
        Robot other = robot_;
        noise.set(noise.of(robot_) * std::exp(0.5 * kDifference), other);
        derivative.of_motions = covariances_of(joint_problem(all_, other, free_));
        for (std::size_t k = 0; k < here.size(); ++k)
          derivative.of_motions[k] = (derivative.of_motions[k] - here[k]) / kDifference;
      }
      all.push_back(std::move(derivative));
    }
    return all;
  }

  /// A Newton step in log σ of what is sought; returns its greatest length in sigmas.
  double step() {
    joint_ = joint_problem(all_, robot_, free_);
    state_ = minimiser_.minimise(joint_.problem, std::move(state_)).state;
    if (!minimiser_.linearise(joint_.problem, state_))
      throw CannotAnswer("the sightings leave poses or landmarks undetermined");
    const ComponentEvidence evidence = component_evidence(joint_.problem, state_, minimiser_, derivatives());
    redundancy_ = evidence.redundancy;
    const auto n = static_cast<Index>(noises_.size());
    constexpr double kPrior = 1.0 / (kPriorSigma * kPriorSigma);  // information
    Eigen::MatrixXd information = 4.0 * evidence.information;     // by log σ = half of log σ²
    VectorXd gradient = 2.0 * evidence.score;
    for (Index c = 0; c < n; ++c) {
      const auto i = static_cast<std::size_t>(c);
      information(c, c) += kPrior;
      gradient[c] -= kPrior * std::log(noises_[i].of(robot_) / given_[i]);
      if (is_sought_[i]) continue;
      information.row(c).setZero();
      information.col(c).setZero();
      information(c, c) = kPrior;
      gradient[c] = 0.0;
    }
    const Eigen::MatrixXd covariance = inverse_of(information);
    sigma_ = covariance.diagonal().cwiseSqrt();
    const VectorXd by = (covariance * gradient).cwiseMax(-kMostStep).cwiseMin(kMostStep);
    for (std::size_t i = 0; i < noises_.size(); ++i)
      if (is_sought_[i]) noises_[i].set(noises_[i].of(robot_) * std::exp(by[static_cast<Index>(i)]), robot_);
    return by.cwiseQuotient(sigma_).cwiseAbs().maxCoeff();
  }

  bool drop_least_determined() {
    std::size_t least = noises_.size();
    for (std::size_t i = 0; i < noises_.size(); ++i)
      if (is_sought_[i] && sigma_[static_cast<Index>(i)] > kDeterminedSigma &&
          (least == noises_.size() || sigma_[static_cast<Index>(i)] > sigma_[static_cast<Index>(least)]))
        least = i;
    if (least == noises_.size()) return false;
    is_sought_[least] = false;
    noises_[least].set(given_[least], robot_);
    return true;
  }

  std::span<const AssociatedRecording> all_;
  FreeColumns free_;
  Robot robot_;
  std::vector<Noise> noises_;
  std::vector<double> given_;
  std::vector<bool> is_sought_;
  SmoothingState state_;
  JointProblem joint_;
  Minimiser minimiser_;
  VectorXd sigma_;  ///< of log σ
  VectorXd redundancy_;
};

}  // namespace

LandmarkNoise learn_landmark_noise(std::span<const AssociatedRecording> all, const LandmarkFit& fit,
                                   const Robot& given) {
  return NoiseSearch(all, fit, given).found();
}

Robot with_noise_of(const Robot& noisy, Robot robot) {
  robot.chassis.noise = noisy.chassis.noise;
  for (std::size_t i = 0; i < robot.chassis.wheels().size(); ++i)
    robot.chassis.wheels()[i].noise_per_sqrt_m = noisy.chassis.wheels()[i].noise_per_sqrt_m;
  if (robot.chassis.gyro) robot.chassis.gyro->noise_rad_s_sqrt_hz = noisy.chassis.gyro->noise_rad_s_sqrt_hz;
  robot.landmark_sensor->range_sigma_m = noisy.landmark_sensor->range_sigma_m;
  robot.landmark_sensor->bearing_sigma_rad = noisy.landmark_sensor->bearing_sigma_rad;
  return robot;
}

}  // namespace trundle::slam
