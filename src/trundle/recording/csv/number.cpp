#include "trundle/recording/csv/number.hpp"

#include <charconv>
#include <cstdlib>
#include <string>

namespace trundle::recording {

const char* read_any_number(const char* first, const char* last, double& value) {
  const char* const digits = first != last && *first == '+' ? first + 1 : first;
  if (digits != first && digits != last && *digits == '-') return first;
  const std::from_chars_result result = std::from_chars(digits, last, value);
  if (result.ec == std::errc::invalid_argument) return first;
  // Beyond the range of double from_chars gives no value; strtod gives ±inf, a denormal or ±0.
  if (result.ec == std::errc::result_out_of_range)
    value = std::strtod(std::string(digits, result.ptr).c_str(), nullptr);
  return result.ptr;
}

}  // namespace trundle::recording
