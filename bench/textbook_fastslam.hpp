#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "trundle/slam/steps.hpp"

namespace trundle::bench {
using namespace slam;

/// FastSLAM 1.0 as a careful programmer writes it after the textbook [Thrun, Burgard & Fox 2005, table 13.1]:
/// each particle's landmarks stand one after the other in memory, resampling copies the maps of duplicated
/// children only, everything in double. The yardstick of the speed of our own; it shares no code with it.
class TextbookFastSlam {
 public:
  struct Noise {
    double step_m, turn_rad;      ///< of one motion
    double range_m, bearing_rad;  ///< of one reading
  };

  TextbookFastSlam(std::size_t particles, std::size_t landmarks, const Noise& noise)
      : noise_(noise), landmarks_(landmarks), maps_(particles * landmarks), particles_(particles) {
    for (std::size_t i = 0; i < particles; ++i) particles_[i].map = i;
  }

  void step(const Pose2& motion, const std::vector<Observation>& observations) {
    for (Particle& p : particles_) {
      move(p, motion);
      Landmark* const map = maps_.data() + p.map * landmarks_;
      for (const Observation& z : observations) {
        Landmark& m = map[z.landmark];
        if (m.xx > 0.0)
          update(p, z, m);
        else
          create(p, z, m);
      }
    }
    resample();
  }

  Vector2 mean() const {
    Vector2 sum = Vector2::Zero();
    for (const Particle& p : particles_) sum += p.weight * Vector2(p.x, p.y);
    return sum;
  }

 private:
  struct Landmark {
    double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  };
  struct Particle {
    double x = 0.0, y = 0.0, heading = 0.0;
    double log_weight = 0.0;
    double weight = 0.0;
    std::size_t map = 0;  ///< which of the maps is its own
  };

  void move(Particle& p, const Pose2& motion) {
    const double forward = motion.x + noise_.step_m * normal_(engine_);
    const double turn = motion.heading + noise_.turn_rad * normal_(engine_);
    const double c = std::cos(p.heading);
    const double s = std::sin(p.heading);
    p.x += c * forward - s * motion.y;
    p.y += s * forward + c * motion.y;
    p.heading += turn;
  }

  void update(Particle& p, const Observation& z, Landmark& m) const {
    const double dx = m.x - p.x;
    const double dy = m.y - p.y;
    const double q = dx * dx + dy * dy;
    const double range = std::sqrt(q);
    const double nu_r = z.range_m - range;
    double nu_b = z.bearing_rad - (std::atan2(dy, dx) - p.heading);
    nu_b -= 2.0 * kPi * std::floor((nu_b + kPi) / (2.0 * kPi));
    const double hrx = dx / range, hry = dy / range;  // H
    const double hbx = -dy / q, hby = dx / q;
    const double prx = m.xx * hrx + m.xy * hry, pry = m.xy * hrx + m.yy * hry;  // P Hᵀ
    const double pbx = m.xx * hbx + m.xy * hby, pby = m.xy * hbx + m.yy * hby;
    const double srr = hrx * prx + hry * pry + noise_.range_m * noise_.range_m;
    const double srb = hrx * pbx + hry * pby;
    const double sbb = hbx * pbx + hby * pby + noise_.bearing_rad * noise_.bearing_rad;
    const double det = srr * sbb - srb * srb;
    const double inverse = 1.0 / det;
    const double krx = (prx * sbb - pbx * srb) * inverse, kry = (pry * sbb - pby * srb) * inverse;
    const double kbx = (pbx * srr - prx * srb) * inverse, kby = (pby * srr - pry * srb) * inverse;
    p.log_weight -=
        0.5 * ((nu_r * nu_r * sbb - 2.0 * nu_r * nu_b * srb + nu_b * nu_b * srr) * inverse + std::log(det));
    m.x += krx * nu_r + kbx * nu_b;
    m.y += kry * nu_r + kby * nu_b;
    m.xx -= krx * prx + kbx * pbx;
    m.xy -= krx * pry + kbx * pby;
    m.yy -= kry * pry + kby * pby;
  }

  void create(const Particle& p, const Observation& z, Landmark& m) const {
    const double c = std::cos(p.heading + z.bearing_rad);
    const double s = std::sin(p.heading + z.bearing_rad);
    const double along = noise_.range_m * noise_.range_m;
    const double across = std::pow(z.range_m * noise_.bearing_rad, 2);
    m = {p.x + z.range_m * c, p.y + z.range_m * s, along * c * c + across * s * s, (along - across) * c * s,
         along * s * s + across * c * c};
  }

  void resample() {
    const std::size_t count = particles_.size();
    double largest = particles_[0].log_weight;
    for (const Particle& p : particles_) largest = std::max(largest, p.log_weight);
    double sum = 0.0;
    for (Particle& p : particles_) sum += p.weight = std::exp(p.log_weight -= largest);
    double squares = 0.0;
    for (Particle& p : particles_) {
      p.weight /= sum;
      squares += p.weight * p.weight;
    }
    if (1.0 / squares >= 0.5 * static_cast<double>(count)) return;
    ++resamplings;
    children_.assign(count, 0);
    const double offset = uniform_(engine_);
    double reached = particles_[0].weight;
    std::size_t parent = 0;
    for (std::size_t i = 0; i < count; ++i) {
      while (reached < (static_cast<double>(i) + offset) / static_cast<double>(count) && parent + 1 < count)
        reached += particles_[++parent].weight;
      ++children_[parent];
    }
    std::size_t dead = 0;
    for (std::size_t i = 0; i < count; ++i)
      for (; children_[i] > 1; --children_[i]) {
        while (children_[dead] > 0 || dead == i) ++dead;
        copy(particles_[i], particles_[dead]);
        children_[dead++] = 1;
      }
    for (Particle& p : particles_) {
      p.log_weight = 0.0;
      p.weight = 1.0 / static_cast<double>(count);
    }
  }

  void copy(const Particle& parent, Particle& child) {
    const std::size_t own = child.map;
    child = parent;
    child.map = own;
    std::copy_n(maps_.data() + parent.map * landmarks_, landmarks_, maps_.data() + own * landmarks_);
  }

  Noise noise_;
  std::size_t landmarks_;
  std::vector<Landmark> maps_;
  std::vector<Particle> particles_;
  std::vector<std::size_t> children_;
  std::mt19937_64 engine_{1};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;

 public:
  std::size_t resamplings = 0;
};

}  // namespace trundle::bench
