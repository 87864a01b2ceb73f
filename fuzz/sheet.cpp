// An UMBmark sheet.
#include "trundle/calibration/squares/sheet.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return trundle::fuzz::try_to(
      [&] { trundle::calibration::parse_sheet(trundle::fuzz::text_of(data, size), "sheet.csv"); });
}
