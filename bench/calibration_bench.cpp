// Calibration from 100 000 increments, each with a measured motion of a sensor, six parameters: both
// diameters, the track, the sensor's pose. Gauss–Newton over accumulate_relative against Ceres with analytic
// and with automatic derivatives, from the same cold start. All variants take turns; medians are printed.
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "trundle/calibration/likelihood/relative_kernel.hpp"
#include "trundle/geometry/pose2.hpp"
#include "trundle/statistics/random.hpp"

#ifdef TRUNDLE_BENCH_CERES
#include <ceres/ceres.h>
#endif

namespace {

using namespace trundle::pipeline;

constexpr std::size_t kRows = 100'000;
constexpr int kRounds = 7;
using Six = Eigen::Matrix<double, 6, 1>;  // left and right diameter, track, sensor x, y, heading

struct Log {
  std::vector<double> left, right;  // revolutions
  std::array<std::vector<double>, 3> motion;
};

/// [σ⁻¹] of a measured motion: 1 mm, 1 mm, 2 mrad.
const Vector3 kWhitening(1e3, 1e3, 5e2);

Six truth() {
  return (Six() << 0.0709, 0.0698, 0.236, 0.12, -0.03, 0.35).finished();
}
Six nominal() {
  return (Six() << 0.07, 0.07, 0.23, 0.10, 0.0, 0.3).finished();
}

Pose2 predicted(const Six& p, double left, double right) {
  const double dl = kPi * p[0] * left;
  const double dr = kPi * p[1] * right;
  const Pose2 mount{p[3], p[4], p[5]};
  return mount.inverse() * exp({0.5 * (dl + dr), 0.0, (dr - dl) / p[2]}) * mount;
}

Log simulated() {
  Random random(1);
  Log log;
  for (std::size_t i = 0; i < kRows; ++i) {
    const double forward = random.uniform(-0.2, 0.6);
    const double bend = random.uniform(-0.1, 0.1);
    log.left.push_back(forward - bend);
    log.right.push_back(forward + bend);
    const Pose2 motion = predicted(truth(), log.left.back(), log.right.back());
    log.motion[0].push_back(motion.x + random.normal(1.0 / kWhitening[0]));
    log.motion[1].push_back(motion.y + random.normal(1.0 / kWhitening[1]));
    log.motion[2].push_back(motion.heading + random.normal(1.0 / kWhitening[2]));
  }
  return log;
}

Robot robot_of(const Six& p) {
  Robot robot;
  robot.chassis = differential_drive({.diameter_m = p[0]}, p[2]);
  robot.chassis.wheels()[1].diameter_m = p[1];
  return robot;
}

struct Solution {
  Six parameters = Six::Zero();
  int iterations = 0;
};

Solution gauss_newton(const Log& log) {
  const std::array<Parameter, 3> parameters = {
      {{ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}, {ParameterKind::track, -1}}};
  const RelativeColumns columns{.input = {log.left, log.right},
                                .x_m = log.motion[0],
                                .y_m = log.motion[1],
                                .heading_rad = log.motion[2]};
  RelativeWeights weights;
  weights.information = kWhitening.cwiseAbs2().asDiagonal();
  Solution solution{nominal(), 0};
  for (double largest = 1.0; largest > 1e-12 && solution.iterations < 50; ++solution.iterations) {
    const Six& p = solution.parameters;
    const MotionModel model(robot_of(p).chassis, parameters, false);
    const RelativeNormalEquations sums =
        accumulate_relative(columns, model.linearised(), {p[3], p[4], p[5]}, weights);
    const Six step = sums.information.ldlt().solve(sums.gradient);
    solution.parameters += step;
    largest = step.cwiseQuotient(solution.parameters).cwiseAbs().maxCoeff();
  }
  return solution;
}

#ifdef TRUNDLE_BENCH_CERES

/// r = measured − ℓ⁻¹ exp(ξ) ℓ, whitened; with v = t + (R(θ) − 1) l, t the chord and its turn.
template <typename T>
struct Arc {
  T dl, dr, turn, sinc, dsinc, c, s, tx, ty;

  Arc(const T* p, double left, double right)
      : dl(kPi * p[0] * left), dr(kPi * p[1] * right), turn((dr - dl) / p[2]) {
    using std::cos;
    using std::sin;
    const T half = 0.5 * turn;
    c = cos(half);
    s = sin(half);
    if (half < 1e-4 && half > -1e-4) {
      sinc = 1.0 - half * half / 6.0;
      dsinc = -half / 3.0;
    } else {
      sinc = s / half;
      dsinc = (c - sinc) / half;
    }
    tx = 0.5 * (dl + dr) * sinc * c;
    ty = 0.5 * (dl + dr) * sinc * s;
  }
};

template <typename T>
struct Prediction {
  T x, y;
};

template <typename T>
Prediction<T> in_sensor(const T* p, const T& vx, const T& vy) {
  using std::cos;
  using std::sin;
  const T c = cos(p[5]);
  const T s = sin(p[5]);
  return {c * vx + s * vy, c * vy - s * vx};
}

struct Automatic {
  double left, right, x, y, turn;

  template <typename T>
  bool operator()(const T* p, T* residual) const {
    const Arc<T> arc(p, left, right);
    const T c = -2.0 * arc.s * arc.s;  // R(θ) − 1
    const T s = 2.0 * arc.s * arc.c;
    const auto [sx, sy] = in_sensor<T>(p, arc.tx + c * p[3] - s * p[4], arc.ty + s * p[3] + c * p[4]);
    residual[0] = kWhitening[0] * (x - sx);
    residual[1] = kWhitening[1] * (y - sy);
    residual[2] = kWhitening[2] * (turn - arc.turn);
    return true;
  }
};

class Analytic : public ceres::SizedCostFunction<3, 6> {
 public:
  explicit Analytic(const Automatic& data) : data_(data) {}

  bool Evaluate(double const* const* parameters, double* residual, double** jacobians) const override {
    const double* p = parameters[0];
    const Arc<double> arc(p, data_.left, data_.right);
    const double c = -2.0 * arc.s * arc.s;
    const double s = 2.0 * arc.s * arc.c;
    const double wx = c * p[3] - s * p[4];
    const double wy = s * p[3] + c * p[4];
    const double cos_mount = std::cos(p[5]);
    const double sin_mount = std::sin(p[5]);
    const double sx = cos_mount * (arc.tx + wx) + sin_mount * (arc.ty + wy);
    const double sy = cos_mount * (arc.ty + wy) - sin_mount * (arc.tx + wx);
    residual[0] = kWhitening[0] * (data_.x - sx);
    residual[1] = kWhitening[1] * (data_.y - sy);
    residual[2] = kWhitening[2] * (data_.turn - arc.turn);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    // Columns of ∂v by forward travel and by the turn.
    const double forward = 0.5 * (arc.dl + arc.dr);
    const double ax = arc.sinc * arc.c;
    const double ay = arc.sinc * arc.s;
    const double bx = 0.5 * (arc.dsinc * arc.c * forward - arc.ty) - (wy + p[4]);
    const double by = 0.5 * (arc.dsinc * arc.s * forward + arc.tx) + (wx + p[3]);
    const double left = kPi * data_.left;
    const double right = kPi * data_.right;
    const double forward_by[3] = {0.5 * left, 0.5 * right, 0.0};
    const double turn_by[3] = {-left / p[2], right / p[2], -arc.turn / p[2]};
    double* J = jacobians[0];
    const auto put = [&](int column, double vx, double vy, double turn) {
      J[column] = -kWhitening[0] * (cos_mount * vx + sin_mount * vy);
      J[6 + column] = -kWhitening[1] * (cos_mount * vy - sin_mount * vx);
      J[12 + column] = -kWhitening[2] * turn;
    };
    for (int j = 0; j < 3; ++j)
      put(j, ax * forward_by[j] + bx * turn_by[j], ay * forward_by[j] + by * turn_by[j], turn_by[j]);
    put(3, c, s, 0.0);
    put(4, -s, c, 0.0);
    J[5] = -kWhitening[0] * sy;
    J[11] = kWhitening[1] * sx;
    J[17] = 0.0;
    return true;
  }

 private:
  Automatic data_;
};

Solution ceres_solution(const Log& log, bool analytic) {
  Solution solution{nominal(), 0};
  ceres::Problem::Options problem_options;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  for (std::size_t i = 0; i < kRows; ++i) {
    const Automatic data{log.left[i], log.right[i], log.motion[0][i], log.motion[1][i], log.motion[2][i]};
    ceres::CostFunction* cost = analytic
                                    ? static_cast<ceres::CostFunction*>(new Analytic(data))
                                    : new ceres::AutoDiffCostFunction<Automatic, 3, 6>(new Automatic(data));
    problem.AddResidualBlock(cost, nullptr, solution.parameters.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  options.initial_trust_region_radius = 1e16;  // Gauss–Newton from the start
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-15;
  options.parameter_tolerance = 1e-12;
  options.max_num_iterations = 50;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  solution.iterations = static_cast<int>(summary.iterations.size());
  return solution;
}

#endif

/// This thread's processor time: what other programs take does not count.
double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

struct Variant {
  std::string name;
  std::function<Solution()> solve;
  Solution solution = {};
  std::vector<double> seconds = {};
};

}  // namespace

int main() {
  const Log log = simulated();
  std::vector<Variant> variants = {{"Gauss-Newton, accumulate_relative", [&] { return gauss_newton(log); }}};
#ifdef TRUNDLE_BENCH_CERES
  variants.push_back({"Ceres, analytic derivatives", [&] { return ceres_solution(log, true); }});
  variants.push_back({"Ceres, automatic derivatives", [&] { return ceres_solution(log, false); }});
#endif
  for (int round = -1; round < kRounds; ++round) {  // the first round warms up
    for (Variant& variant : variants) {
      const double start = processor_seconds();
      variant.solution = variant.solve();
      if (round >= 0) variant.seconds.push_back(processor_seconds() - start);
    }
  }
  const Variant& ours = variants.front();
  fmt::print(
      "{} increments, 6 parameters, cold start, processor time of one thread, median of {} rounds in turn\n",
      kRows, kRounds);
  for (const Variant& variant : variants) {
    const double seconds = median(variant.seconds);
    fmt::print("{:36} {:8.2f} ms {:2} iterations {:7.1f} x   largest difference {:.1e}\n", variant.name,
               1e3 * seconds, variant.solution.iterations, seconds / median(ours.seconds),
               (variant.solution.parameters - ours.solution.parameters).cwiseAbs().maxCoeff());
  }
}
