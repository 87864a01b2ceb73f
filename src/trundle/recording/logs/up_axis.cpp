#include "trundle/recording/logs/detail/up_axis.hpp"

#include <cmath>

namespace trundle::recording {
namespace {

/// Readers of `name`.x and so on; none where the layout has no such fields.
std::vector<logs::FieldReader> readers_of(const logs::Layout& layout, logs::Encoding encoding,
                                          const std::string& name, std::initializer_list<const char*> parts) {
  std::vector<logs::FieldReader> readers;
  for (const char* const part : parts) {
    std::optional<logs::FieldReader> reader = logs::reader_if_known(layout, encoding, name + "." + part);
    if (!reader) return {};
    readers.push_back(std::move(*reader));
  }
  return readers;
}

/// The greatest part of a direction.
UpAxis::Answer axis_of(const std::array<double, 3>& up, const char* evidence) {
  UpAxis::Answer answer{.axis = 0, .evidence = evidence};
  for (std::size_t i = 1; i < up.size(); ++i)
    if (std::abs(up[i]) > std::abs(up[answer.axis])) answer.axis = i;
  answer.sign = up[answer.axis] < 0.0 ? -1.0 : 1.0;
  return answer;
}

}  // namespace

UpAxis::UpAxis(const logs::Layout& layout, logs::Encoding encoding)
    : acceleration_(readers_of(layout, encoding, "linear_acceleration", {"x", "y", "z"})),
      orientation_(readers_of(layout, encoding, "orientation", {"x", "y", "z", "w"})) {}

void UpAxis::add(const logs::Message& message) {
  const auto read = [&](const logs::FieldReader& reader) {
    const double value = logs::number_of(reader.read(message)).value_or(0.0);
    return std::isfinite(value) ? value : 0.0;
  };
  ++messages_;
  for (std::size_t i = 0; i < acceleration_.size(); ++i) acceleration_sum_[i] += read(acceleration_[i]);
  if (orientation_.empty()) return;
  const double x = read(orientation_[0]), y = read(orientation_[1]), z = read(orientation_[2]),
               w = read(orientation_[3]);
  // The world's z axis in the sensor's frame: the last row of the rotation matrix.
  up_sum_[0] += 2.0 * (x * z - w * y);
  up_sum_[1] += 2.0 * (y * z + w * x);
  up_sum_[2] += w * w - x * x - y * y + z * z;
}

UpAxis::Answer UpAxis::answer() const {
  // Of gravity an accelerometer shows all or nothing, in m/s² or in g: half of the smaller unit tells them
  // apart from what driving leaves on average.
  constexpr double kLeastGravity = 0.5;
  constexpr double kLeastUp = 0.5;  // of a direction of length 1
  const auto length = [](const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); };
  const auto messages = static_cast<double>(messages_);
  if (messages_ > 0 && length(acceleration_sum_) > kLeastGravity * messages)
    return axis_of(acceleration_sum_, "accelerometer");
  if (messages_ > 0 && length(up_sum_) > kLeastUp * messages) return axis_of(up_sum_, "orientation");
  return {};
}

}  // namespace trundle::recording
