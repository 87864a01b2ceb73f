#include "trundle/slam/ekf/joint_gaussian.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/Cholesky>

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

// At least so many rows are active before anything is settled: four panels, whose covariance fits the nearest
// cache. Decides the time, not the result.
constexpr Index kLeastActive = 32;
// Rows of the body for which that was counted: pose, and three systematic errors.
constexpr Index kUsualBody = 6;

/// Rows of landmarks. Steps cost the square of what is active, settling costs it once times the square of the
/// map.
Index most_active(Index all, Index needed) {
  const auto root = static_cast<Index>(2.0 * std::sqrt(static_cast<double>(kUsualBody + all)));
  return std::max({kLeastActive, 2 * (kUsualBody + needed), root}) - kUsualBody;
}

/// Larger in both directions, old numbers kept, new ones zero.
void grow(Eigen::MatrixXd& matrix, Index size) {
  if (size <= matrix.rows()) return;
  Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(whole_panels(std::max(size, 2 * matrix.rows())),
                                                 whole_panels(std::max(size, 2 * matrix.rows())));
  larger.topLeftCorner(matrix.rows(), matrix.cols()) = matrix;
  matrix = std::move(larger);
}

void grow(Eigen::VectorXd& vector, Index size) {
  if (size <= vector.size()) return;
  Eigen::VectorXd larger = Eigen::VectorXd::Zero(whole_panels(std::max(size, 2 * vector.size())));
  larger.head(vector.size()) = vector;
  vector = std::move(larger);
}

/// Room for as many columns.
void widen(Eigen::MatrixXd& matrix, Index rows, Index columns) {
  if (rows > matrix.rows() || columns > matrix.cols())
    matrix.resize(std::max(rows, matrix.rows()), std::max(2 * columns, matrix.cols()));
}

/// Entry of a symmetric matrix of which the lower triangle counts.
double entry(const Eigen::MatrixXd& lower, Index row, Index column) {
  return row >= column ? lower(row, column) : lower(column, row);
}

/// M Hᵀ, of H with entries at the pose and at one landmark, is made of sums of five columns of M.
void sums_of(std::span<const JointGaussian::Rows> H, std::vector<PackedPanels::Sum>& sums) {
  sums.clear();
  for (const JointGaussian::Rows& rows : H)
    for (Index i = 0; i < 2; ++i)
      sums.push_back({{0, 1, 2, rows.at, rows.at + 1},
                      {rows.by_pose(i, 0), rows.by_pose(i, 1), rows.by_pose(i, 2), rows.by_landmark(i, 0),
                       rows.by_landmark(i, 1)}});
}

}  // namespace

JointGaussian::JointGaussian(const SlamPrior& prior)
    : body_(kPose + prior.systematic_sigma.size()), size_(body_) {
  grow_active(kLeastActive);
  grow_settled(kLeastActive);
  mean_.head<3>() << prior.start.x, prior.start.y, prior.start.heading;
  A_.topLeftCorner<3, 3>() = prior.start_covariance;
  A_.block(kPose, kPose, systematic(), systematic()) = prior.systematic_sigma.cwiseAbs2().asDiagonal();
  P_.topLeftCorner(body_, body_) = A_.topLeftCorner(body_, body_);
  settled_mean_.head(body_) = mean_.head(body_);
  transfer_.topLeftCorner(body_, body_).setIdentity();
  for (Index i = 0; i < body_; ++i) settled_of_.push_back(i);
}

void JointGaussian::grow_active(Index size) {
  grow(mean_, size);
  grow(A_, size);
  grow(transfer_, size);
  grow(learned_, size);
  grow(learned_mean_, size);
}

void JointGaussian::grow_settled(Index size) {
  grow(settled_mean_, size);
  grow(P_, size);
}

PoseEstimate JointGaussian::body() const {
  const Index n = systematic();
  return {pose(), A_.topLeftCorner<3, 3>(), mean_.segment(kPose, n), A_.block(kPose, kPose, n, n),
          A_.block(0, kPose, 3, n)};
}

/// P0 of some rows with what is active.
Eigen::MatrixXd JointGaussian::settled_with_active(Index row, Index rows) const {
  Eigen::MatrixXd block(rows, size_);
  for (Index k = 0; k < size_; ++k)
    for (Index i = 0; i < rows; ++i)
      block(i, k) = entry(P_, row + i, settled_of_[static_cast<std::size_t>(k)]);
  return block;
}

Vector2 JointGaussian::landmark(std::size_t landmark) const {
  if (is_active(landmark)) return mean_.segment<2>(index_of(landmark));
  const Index row = body_ + 2 * static_cast<Index>(landmark);
  return settled_mean_.segment<2>(row) + settled_with_active(row, 2) * learned_mean_.head(size_);
}

Matrix2 JointGaussian::landmark_covariance(std::size_t landmark) const {
  if (is_active(landmark)) return A_.block<2, 2>(index_of(landmark), index_of(landmark));
  const Index row = body_ + 2 * static_cast<Index>(landmark);
  const Eigen::MatrixXd with_active = settled_with_active(row, 2);
  const Matrix2 before = P_.block<2, 2>(row, row).selfadjointView<Eigen::Lower>();
  return before + with_active * learned_.topLeftCorner(size_, size_) * with_active.transpose();
}

Eigen::MatrixXd JointGaussian::covariance() const {
  JointGaussian copy = *this;
  copy.settle();
  return copy.P_.topLeftCorner(total(), total()).selfadjointView<Eigen::Lower>();
}

void JointGaussian::activate(std::span<const std::size_t> landmarks) {
  Index passive = 0;
  for (const std::size_t landmark : landmarks) passive += is_active(landmark) ? 0 : 2;
  const Index needed = 2 * static_cast<Index>(landmarks.size());
  if (size_ + passive - body_ > most_active(total() - body_, needed)) settle();
  grow_active(std::max(size_ + passive, body_ + needed));
  for (const std::size_t landmark : landmarks) {
    if (is_active(landmark)) continue;
    const Index row = body_ + 2 * static_cast<Index>(landmark);
    const Eigen::Matrix<double, 2, Eigen::Dynamic> before = settled_with_active(row, 2);
    const auto learned = learned_.topLeftCorner(size_, size_);
    const Eigen::Matrix<double, 2, Eigen::Dynamic> change = before * learned;
    mean_.segment<2>(size_) = settled_mean_.segment<2>(row) + before * learned_mean_.head(size_);
    A_.block(size_, 0, 2, size_).noalias() = before * transfer_.topLeftCorner(size_, size_);
    A_.block(0, size_, size_, 2) = A_.block(size_, 0, 2, size_).transpose();
    A_.block<2, 2>(size_, size_) =
        Matrix2(P_.block<2, 2>(row, row).selfadjointView<Eigen::Lower>()) + change * before.transpose();
    transfer_.block(size_, 0, 2, size_).setZero();
    transfer_.block(0, size_, size_, 2) = change.transpose();
    transfer_.block<2, 2>(size_, size_).setIdentity();
    learned_.block(size_, 0, 2, size_ + 2).setZero();
    learned_.block(0, size_, size_, 2).setZero();
    learned_mean_.segment<2>(size_).setZero();
    active_of_[landmark] = size_;
    settled_of_.insert(settled_of_.end(), {row, row + 1});
    size_ += 2;
  }
}

// Eq. 5. Landmarks stay where they are: of their part only the covariance with the pose changes.
void JointGaussian::predict(const Prediction& p) {
  const Index n = systematic();
  const Matrix3 xx = A_.topLeftCorner<3, 3>();
  const SystematicCovariance ss = A_.block(kPose, kPose, n, n);
  const BySystematic xs = A_.block(0, kPose, 3, n);
  const auto move = [&](Eigen::MatrixXd& rows, Index i) {
    Vector3 row = p.F * rows.block<1, 3>(i, 0).transpose();
    for (Index k = 0; k < n; ++k) row += rows(i, kPose + k) * p.W.col(k);
    rows.block<1, 3>(i, 0) = row.transpose();
  };
  for (Index i = kPose; i < size_; ++i) move(A_, i);
  if (p.walk > 0.0) {
    A_.block<1, 3>(kPose, 0) += p.with_walk.transpose();
    A_(kPose, kPose) += p.walk;
  }
  A_.block(0, kPose, 3, size_ - kPose) = A_.block(kPose, 0, size_ - kPose, 3).transpose();
  A_.topLeftCorner<3, 3>() = p.F * (xx * p.F.transpose() + xs * p.W.transpose()) +
                             p.W * (xs.transpose() * p.F.transpose() + ss * p.W.transpose()) + p.noise;
  mean_.head<3>() << p.pose.x, p.pose.y, p.pose.heading;
  if (all_active()) return;
  for (Index i = 0; i < size_; ++i) move(transfer_, i);
}

// Eq. 7 with one row of H, which is 1 at that error.
void JointGaussian::read_systematic(double value, double variance) {
  const double root = std::sqrt(A_(kPose, kPose) + variance);
  if (root == 0.0) return;
  const double whitened = (value - mean_[kPose]) / root;
  const Eigen::VectorXd V = A_.col(kPose).head(size_) / root;
  const Eigen::VectorXd W = transfer_.col(kPose).head(size_) / root;
  mean_.head(size_) += whitened * V;
  A_.topLeftCorner(size_, size_) -= V * V.transpose();
  if (all_active()) return;
  learned_mean_.head(size_) += whitened * W;
  transfer_.topLeftCorner(size_, size_) -= W * V.transpose();
  learned_.topLeftCorner(size_, size_) -= W * W.transpose();
}

Matrix2 JointGaussian::projected_covariance(const Rows& H) const {
  const Matrix2 mixed = H.by_landmark * A_.block<2, 3>(H.at, 0) * H.by_pose.transpose();
  return H.by_pose * A_.topLeftCorner<3, 3>() * H.by_pose.transpose() + mixed + mixed.transpose() +
         H.by_landmark * A_.block<2, 2>(H.at, H.at) * H.by_landmark.transpose();
}

void JointGaussian::cross_covariance(std::span<const Rows> H, PackedPanels& PHt) const {
  sums_of(H, sums_);
  PHt.assign_sums(A_, size_, sums_);
}

void JointGaussian::projected_covariance(std::span<const Rows> H, const PackedPanels& PHt,
                                         Eigen::MatrixXd& S) const {
  const Index columns = 2 * static_cast<Index>(H.size());
  widen(S, columns, columns);
  for (std::size_t k = 0; k < H.size(); ++k)
    for (Index column = 0; column < columns; ++column) {
      const Vector3 pose(PHt(0, column), PHt(1, column), PHt(2, column));
      const Vector2 landmark(PHt(H[k].at, column), PHt(H[k].at + 1, column));
      S.block<2, 1>(2 * static_cast<Index>(k), column) = H[k].by_pose * pose + H[k].by_landmark * landmark;
    }
}

// Eq. 7: S = C Cᵀ, V = A Hᵀ C⁻ᵀ, W = transfer Hᵀ C⁻ᵀ.
void JointGaussian::update(std::span<const Rows> H, PackedPanels& PHt, const Eigen::MatrixXd& S,
                           Eigen::VectorXd& innovation) {
  const Index columns = 2 * static_cast<Index>(H.size());
  widen(root_, columns, columns);
  auto root = root_.topLeftCorner(columns, columns);
  root = S.topLeftCorner(columns, columns);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(root);
  assert(factor.info() == Eigen::Success);
  auto whitened = innovation.head(columns);
  factor.matrixL().solveInPlace(whitened);
  PackedPanels& V = PHt;
  V.divide_by(root);
  V.add_product_to(mean_, whitened.data());
  subtract_product(V, V, Part::all, A_);
  if (all_active()) return;
  sums_of(H, sums_);
  W_.assign_sums(transfer_, size_, sums_);
  W_.divide_by(root);
  W_.add_product_to(learned_mean_, whitened.data());
  subtract_product(W_, V, Part::all, transfer_);
  subtract_product(W_, W_, Part::all, learned_);
}

// Eq. 8. What is passive has to do with the new landmark only through the pose.
void JointGaussian::append(const Vector2& place, const Matrix23& by_pose, const Matrix2& noise) {
  const Index row = total();
  grow_active(size_ + 2);
  grow_settled(row + 2);
  A_.block(size_, 0, 2, size_).noalias() = by_pose * A_.topLeftCorner(3, size_);
  A_.block(0, size_, size_, 2) = A_.block(size_, 0, 2, size_).transpose();
  A_.block<2, 2>(size_, size_) = A_.block<2, 3>(size_, 0) * by_pose.transpose() + noise;
  transfer_.block(size_, 0, 2, size_ + 2).setZero();
  transfer_.block(0, size_, size_, 2) = transfer_.topLeftCorner(size_, 3) * by_pose.transpose();
  learned_.block(size_, 0, 2, size_ + 2).setZero();
  learned_.block(0, size_, size_, 2).setZero();
  learned_mean_.segment<2>(size_).setZero();
  mean_.segment<2>(size_) = place;
  P_.block(row, 0, 2, row + 2).setZero();
  settled_mean_.segment<2>(row).setZero();
  active_of_.push_back(size_);
  settled_of_.insert(settled_of_.end(), {row, row + 1});
  size_ += 2;
}

void JointGaussian::remove(std::size_t landmark) {
  settle();
  const Index last = total() - 2;
  const Index row = body_ + 2 * static_cast<Index>(landmark);
  for (Index i = 0; row < last && i < last; ++i) {
    if (i == row || i == row + 1) continue;
    for (Index k = 0; k < 2; ++k) (i > row ? P_(i, row + k) : P_(row + k, i)) = entry(P_, last + k, i);
  }
  P_.block<2, 2>(row, row) = P_.block<2, 2>(last, last).eval();
  settled_mean_.segment<2>(row) = settled_mean_.segment<2>(last).eval();
  active_of_.pop_back();
}

/// Everything as it is now; of the landmarks none stays active.
void JointGaussian::settle() {
  if (!all_active()) settle_passive();
  for (Index k = 0; k < size_; ++k) {
    const Index column = settled_of_[static_cast<std::size_t>(k)];
    settled_mean_[column] = mean_[k];
    for (Index i = 0; i < size_; ++i)
      if (const Index row = settled_of_[static_cast<std::size_t>(i)]; row >= column)
        P_(row, column) = A_(i, k);
  }
  std::ranges::fill(active_of_, -1);
  size_ = body_;
  settled_of_.resize(static_cast<std::size_t>(body_));
  transfer_.topLeftCorner(body_, body_).setIdentity();
  learned_.topLeftCorner(body_, body_).setZero();
  learned_mean_.head(body_).setZero();
}

/// What the passive rows have learned. Active ones are computed with them and written over later.
void JointGaussian::settle_passive() {
  const Index rows = total();
  const Eigen::MatrixXd U = settled_with_active(0, rows);
  settled_mean_.head(rows).noalias() += U * learned_mean_.head(size_);
  PackedPanels of_U, of_active, of_product;
  of_U.pack(U);
  const auto minus_U_times = [&](const Eigen::MatrixXd& transposed) {
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(whole_panels(rows), whole_panels(size_));
    of_active.pack(transposed);
    subtract_product(of_U, of_active, Part::all, product);
    return product;
  };
  of_product.pack(minus_U_times(learned_.topLeftCorner(size_, size_)).topLeftCorner(rows, size_));
  subtract_product(of_product, of_U, Part::lower, P_);
  const Eigen::MatrixXd with_active = -minus_U_times(transfer_.topLeftCorner(size_, size_).transpose());
  for (Index k = 0; k < size_; ++k) {
    const Index column = settled_of_[static_cast<std::size_t>(k)];
    for (Index row = 0; row < rows; ++row)
      (row >= column ? P_(row, column) : P_(column, row)) = with_active(row, k);
  }
}

}  // namespace trundle::slam
