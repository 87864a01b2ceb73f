#include "trundle/calibration/squares/square_fit.hpp"

#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/descent.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Below these, differences between readings are rounding of whoever wrote them down.
constexpr double kSmallestLengthSigmaM = 1e-4;
constexpr double kSmallestHeadingSigmaRad = 1e-4;  // 0.006°

/// Correlations of three readings mean something from here on.
constexpr int kDegreesOfFreedomForCorrelations = 8;

double widening(int degrees_of_freedom) {
  const double ratio = student_t_limit(0.05, degrees_of_freedom) / kNormalAt95;
  return ratio * ratio;
}

Vector3 vector_of(const Pose2& pose) {
  return {pose.x, pose.y, pose.heading};
}

/// A clockwise square is the mirror image of a counter-clockwise one: seen in the mirror their scatters are
/// alike.
Vector3 mirrored(const Vector3& error) {
  return {error.x(), -error.y(), -error.z()};
}
Matrix3 mirrored(const Matrix3& covariance) {
  const Matrix3 mirror = Vector3(1.0, -1.0, -1.0).asDiagonal();
  return mirror * covariance * mirror;
}

struct Scatter3 {
  Matrix3 covariance = Matrix3::Zero();  ///< of one run, as counter-clockwise
  int degrees_of_freedom = 0;
};

Scatter3 scatter_of_runs(const SquareSheet& sheet, const SquareMeans& means) {
  Scatter3 scatter;
  scatter.degrees_of_freedom = static_cast<int>(sheet.runs.size()) - 2;
  if (scatter.degrees_of_freedom == 0) {
    const double length = kAssumedPositionSigmaInSides * sheet.side_m;
    scatter.covariance.diagonal() << length * length, length * length, std::pow(kAssumedHeadingSigmaRad, 2);
    return scatter;
  }
  for (const SquareRun& run : sheet.runs) {
    const Vector3 error = vector_of(run.error);
    const Vector3 off = run.turn == Turn::ccw ? Vector3(error - vector_of(means.ccw))
                                              : mirrored(Vector3(error - vector_of(means.cw)));
    scatter.covariance += off * off.transpose() / scatter.degrees_of_freedom;
  }
  return scatter;
}

int runs_of(const SquareSheet& sheet, Turn turn) {
  int count = 0;
  for (const SquareRun& run : sheet.runs) count += run.turn == turn ? 1 : 0;
  return count;
}

/// Variance of the mean leg, widened.
double leg_variance(const SquareSheet& sheet, double mean, int& legs) {
  double sum = 0.0;
  for (const SquareRun& run : sheet.runs) {
    if (!run.leg_m) continue;
    ++legs;
    sum += (*run.leg_m - mean) * (*run.leg_m - mean);
  }
  if (legs == 1) return kAssumedLegSigmaM * kAssumedLegSigmaM;
  return widening(legs - 1) * sum / ((legs - 1.0) * legs);
}

SquareMatrix weight_of(const SquareStatistics& statistics) {
  SquareMatrix covariance = statistics.covariance;
  if (statistics.degrees_of_freedom < kDegreesOfFreedomForCorrelations)
    covariance = covariance.diagonal().asDiagonal();
  SquareVector floor;
  constexpr double length = kSmallestLengthSigmaM * kSmallestLengthSigmaM;
  constexpr double heading = kSmallestHeadingSigmaRad * kSmallestHeadingSigmaRad;
  floor << length, length, heading, length, length, heading, length;
  covariance += floor.asDiagonal();
  SquareMatrix weight = covariance.inverse();
  if (statistics.legs == 0) weight(6, 6) = 0.0;
  return weight;
}

SquareVector readings_of(const SquareMeans& means) {
  SquareVector readings;
  readings << vector_of(means.cw), vector_of(means.ccw), means.leg_m.value_or(0.0);
  return readings;
}

SquareMeans with_readings(SquareMeans means, const SquareVector& z) {
  means.cw = {z[0], z[1], z[2]};
  means.ccw = {z[3], z[4], z[5]};
  if (means.leg_m) means.leg_m = z[6];
  return means;
}

/// A square of known sides and nominal robot: everything that the functions below share.
struct SquareProblem {
  const SquareStatistics& statistics;
  double side_m;
  SidedDrive nominal;

  SquareVector predict(const SidedDrive& drive) const {
    SquareVector z;
    z << vector_of(predict_square(drive, nominal, side_m, Turn::cw)),
        vector_of(predict_square(drive, nominal, side_m, Turn::ccw)), predict_leg(drive, nominal, side_m);
    return z;
  }
};

/// Central differences with steps of 1e-6 of each unknown's own size: the predictions are smooth, the error
/// ~1e-10.
template <int kRows, int kColumns, class Function>
Eigen::Matrix<double, kRows, kColumns> derivative(const Function& f,
                                                  const Eigen::Matrix<double, kColumns, 1>& at,
                                                  const Eigen::Matrix<double, kColumns, 1>& size) {
  Eigen::Matrix<double, kRows, kColumns> jacobian;
  for (int i = 0; i < kColumns; ++i) {
    Eigen::Matrix<double, kColumns, 1> step = Eigen::Matrix<double, kColumns, 1>::Zero();
    step[i] = 1e-6 * size[i];
    jacobian.col(i) = (f(at + step) - f(at - step)) / (2.0 * step[i]);
  }
  return jacobian;
}

Eigen::Matrix<double, kSquareReadings, 3> prediction_jacobian(const SquareProblem& problem,
                                                              const SidedDrive& drive) {
  return derivative<kSquareReadings, 3>(
      [&](const Vector3& v) { return problem.predict(SidedDrive::from(v)); }, drive.vector(), drive.vector());
}

/// Which ways the drive may move: all three, or those that keep the mean diameter.
Eigen::MatrixXd freedom(const SidedDrive& nominal, bool mean_held) {
  if (!mean_held) return Matrix3::Identity();
  Eigen::MatrixXd ways(3, 2);
  ways << -nominal.left_diameter_m, 0.0, nominal.right_diameter_m, 0.0, 0.0, 1.0;
  return ways;
}

/// Gauss–Newton on the exact model. docs/theory/umbmark.md, eq. 13.
class SquareSearch {
 public:
  SquareSearch(const SquareProblem& problem, const SquareVector& readings, const SidedDrive& start,
               bool mean_held)
      : drive(start), problem_(problem), readings_(readings), ways_(freedom(problem.nominal, mean_held)) {}

  std::optional<NewtonStep> solve() {
    const SquareMatrix& W = problem_.statistics.weight;
    const Eigen::MatrixXd J = prediction_jacobian(problem_, drive) * ways_;
    const Eigen::MatrixXd N = J.transpose() * W * J;
    const Eigen::VectorXd step = solve_ldlt(N, J.transpose() * W * (readings_ - problem_.predict(drive)));
    change_ = ways_ * step;
    return NewtonStep{.sigmas = std::sqrt(step.dot(N * step))};
  }
  bool advance() {
    drive = SidedDrive::from(drive.vector() + change_);
    return drive.vector().allFinite() && drive.vector().minCoeff() > 0.0;
  }
  bool damp() const { return false; }

  SidedDrive drive;

 private:
  const SquareProblem& problem_;
  const SquareVector& readings_;
  Eigen::MatrixXd ways_;
  Vector3 change_ = Vector3::Zero();
};

SidedDrive most_likely(const SquareProblem& problem, const SquareVector& readings, const SidedDrive& start,
                       bool mean_held) {
  // Sheets that contradict themselves creep, and a tenth of a sigma does not show in the error bars.
  constexpr double kHardlyMoves = 0.1;
  SquareSearch search(problem, readings, start, mean_held);
  const Descent descent = descend(search, {.most_iterations = 50, .converged = 1e-8});
  if (!(descent.last_step < kHardlyMoves) || !(search.drive.vector().minCoeff() > 0.0))
    throw CannotAnswer(
        "no robot explains the sheet: its positions and headings contradict each other, and the fit runs "
        "away; are signs right: x ahead, y to the left, headings counter-clockwise?");
  return search.drive;
}

SidedDrive with_nominal_mean(const SidedDrive& drive, const SidedDrive& nominal) {
  const double scale = 0.5 * (drive.left_diameter_m / nominal.left_diameter_m +
                              drive.right_diameter_m / nominal.right_diameter_m);
  return SidedDrive::from(drive.vector() / scale);
}

/// The readings a method uses.
SquareVector used_by(SquareMethod method, bool has_leg) {
  SquareVector used = SquareVector::Ones();
  if (method == SquareMethod::classic) used << 1, 0, 0, 1, 0, 0, 0;
  if (method == SquareMethod::orientation) used << 0, 0, 1, 0, 0, 1, 1;
  if (!has_leg) used[6] = 0.0;
  return used;
}

Vector3 prior_sigmas(const SidedDrive& nominal) {
  return {kDiameterPriorShare * nominal.left_diameter_m, kDiameterPriorShare * nominal.right_diameter_m,
          kTrackPriorShare * nominal.track_m};
}

void describe_directions(const SquareProblem& problem, SquareMethod method, SquareFit& fit) {
  const SquareVector used = used_by(method, problem.statistics.means.leg_m.has_value());
  const SquareVector whitening = problem.statistics.weight.diagonal().cwiseSqrt().cwiseProduct(used);
  const Eigen::Matrix<double, kSquareReadings, 3> scaled = whitening.asDiagonal() *
                                                           prediction_jacobian(problem, fit.drive) *
                                                           prior_sigmas(problem.nominal).asDiagonal();
  const RightSingularVectors svd = right_singular_vectors(scaled);
  fit.singular_values = svd.values;
  fit.directions = svd.vectors;
}

/// What the sheet alone says of the mean diameter, all three unknowns free.
double mean_sigma_from_sheet(const SquareProblem& problem, const SidedDrive& drive) {
  const auto J = prediction_jacobian(problem, drive);
  const Matrix3 information = J.transpose() * problem.statistics.weight * J;
  const Eigen::FullPivLU<Matrix3> lu(information);
  if (!lu.isInvertible()) return kInfinite;
  const Vector3 mean(0.5, 0.5, 0.0);
  return std::sqrt(mean.dot(lu.inverse() * mean));
}

/// Value and delta method through the closed form.
void fit_closed_form(const SquareProblem& problem, const SquareVector& readings, SquareMethod method,
                     SquareFit& fit) {
  const auto solve = [&](const SquareVector& z) -> Vector3 {
    const SquareMeans means = with_readings(problem.statistics.means, z);
    return (method == SquareMethod::classic ? solve_classic(means, problem.side_m, problem.nominal)
                                            : solve_orientation(means, problem.side_m, problem.nominal))
        .vector();
  };
  fit.drive = SidedDrive::from(solve(readings));
  SquareVector size;
  size << problem.side_m, problem.side_m, 1.0, problem.side_m, problem.side_m, 1.0, problem.side_m;
  const auto J = derivative<3, kSquareReadings>(solve, readings, size);
  fit.covariance = J * problem.statistics.covariance * J.transpose();
}

/// The estimate moves with the readings by K = (Jᵀ W J)⁻¹ Jᵀ W. docs/theory/umbmark.md, eq. 14.
void fit_likelihood(const SquareProblem& problem, const SquareVector& readings, SquareFit& fit) {
  const SidedDrive exact = solve_orientation(problem.statistics.means, problem.side_m, problem.nominal);
  const SidedDrive start = fit.mean_held ? with_nominal_mean(exact, problem.nominal) : exact;
  fit.drive = most_likely(problem, readings, start, fit.mean_held);
  const SquareMatrix& W = problem.statistics.weight;
  const Eigen::MatrixXd ways = freedom(problem.nominal, fit.mean_held);
  const Eigen::MatrixXd J = prediction_jacobian(problem, fit.drive) * ways;
  const Eigen::MatrixXd K = ways * solve_ldlt_columns(J.transpose() * W * J, J.transpose() * W);
  fit.covariance = K * problem.statistics.covariance * K.transpose();
}

}  // namespace

SquareStatistics statistics_of(const SquareSheet& sheet) {
  SquareStatistics statistics;
  statistics.means = means_of(sheet);
  const Scatter3 scatter = scatter_of_runs(sheet, statistics.means);
  statistics.degrees_of_freedom = scatter.degrees_of_freedom;
  const double factor = scatter.degrees_of_freedom > 0 ? widening(scatter.degrees_of_freedom) : 1.0;
  statistics.covariance.block<3, 3>(0, 0) = factor / runs_of(sheet, Turn::cw) * mirrored(scatter.covariance);
  statistics.covariance.block<3, 3>(3, 3) = factor / runs_of(sheet, Turn::ccw) * scatter.covariance;
  if (statistics.means.leg_m)
    statistics.covariance(6, 6) = leg_variance(sheet, *statistics.means.leg_m, statistics.legs);
  statistics.weight = weight_of(statistics);
  return statistics;
}

SquareFit fit_square(const SquareStatistics& statistics, double side_m, const SidedDrive& nominal,
                     SquareMethod method) {
  const SquareProblem problem = {statistics, side_m, nominal};
  SquareFit fit;
  fit.mean_held = method == SquareMethod::classic || !statistics.means.leg_m;
  fit.mean_sigma_data_m = kInfinite;
  if (method == SquareMethod::ml) {
    fit.mean_sigma_data_m =
        mean_sigma_from_sheet(problem, solve_orientation(statistics.means, side_m, nominal));
    fit.mean_held = !(fit.mean_sigma_data_m < kDiameterPriorShare * nominal.mean_diameter_m());
  }
  const SquareVector readings = readings_of(statistics.means);
  if (method == SquareMethod::ml) {
    fit_likelihood(problem, readings, fit);
  } else {
    fit_closed_form(problem, readings, method, fit);
  }
  if (method == SquareMethod::orientation && !fit.mean_held)
    fit.mean_sigma_data_m = std::sqrt(Vector3(0.5, 0.5, 0.0).dot(fit.covariance * Vector3(0.5, 0.5, 0.0)));
  describe_directions(problem, method, fit);
  return fit;
}

}  // namespace trundle::calibration
