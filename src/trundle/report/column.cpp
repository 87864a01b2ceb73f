#include "trundle/report/column.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <nlohmann/json.hpp>
#include <openssl/evp.h>

namespace trundle::report {
namespace {

std::vector<std::uint8_t> bytes_of(std::span<const double> values, double offset) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(4 * values.size());
  for (const double value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value - offset));
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(bits >> shift));
  }
  return bytes;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');  // EVP_EncodeBlock ends it with a zero
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes.data(),
                  static_cast<int>(bytes.size()));
  text.pop_back();
  return text;
}

}  // namespace

nlohmann::ordered_json column_json(std::span<const double> values) {
  const auto first = std::ranges::find_if(values, [](double v) { return std::isfinite(v); });
  const double offset = first == values.end() ? 0.0 : *first;
  return {{"offset", offset}, {"float32", base64(bytes_of(values, offset))}};
}

nlohmann::ordered_json column_json(std::span<const double> values, std::span<const std::size_t> rows) {
  std::vector<double> chosen;
  chosen.reserve(rows.size());
  for (const std::size_t row : rows) chosen.push_back(values[row]);
  return column_json(chosen);
}

}  // namespace trundle::report
