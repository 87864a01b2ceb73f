// Reading a wheels.csv of about 130 MB: the project's reader against getline + strtod, the same file and the
// same run. Prints the median speed of each over interleaved rounds, and checks that both read the same bits.

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <unistd.h>

#include "trundle/io/file.hpp"
#include "trundle/recording/csv/reader.hpp"

namespace {

using Columns = std::vector<std::vector<double>>;

constexpr std::size_t kRows = 5'000'000;
constexpr std::size_t kColumns = 3;
constexpr int kRounds = 7;

/// A robot at 50 Hz whose wheels count some hundred thousand ticks.
void write_log(const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::binary);
  std::string text = "time_s,left_ticks,right_ticks\n";
  std::uint64_t left = 100000;
  std::uint64_t right = 90000;
  for (std::size_t row = 0; row < kRows; ++row) {
    left += row * 7919 % 83;
    right += row * 104729 % 89;
    fmt::format_to(std::back_inserter(text), "{:.3f},{},{}\n", 1600.0 + 0.02 * static_cast<double>(row), left,
                   right);
    if (text.size() > (1U << 20U)) {
      out << text;
      text.clear();
    }
  }
  out << text;
}

Columns read_with_trundle(const std::filesystem::path& path) {
  const std::string text = trundle::io::read_file(path);
  const trundle::recording::CsvTable table(text, path.string(), {});
  std::vector<trundle::recording::CsvColumn> wanted;
  for (std::size_t column = 0; column < kColumns; ++column) wanted.push_back({column});
  return table.read(wanted).numbers;
}

Columns read_with_strtod(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  Columns columns(kColumns);
  while (std::getline(in, line)) {
    char* p = line.data();
    for (auto& column : columns) {
      column.push_back(std::strtod(p, &p));
      if (*p == ',') ++p;
    }
  }
  return columns;
}

/// This thread's time on a core: other programs on the machine do not count.
double core_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

template <class Read>
double seconds(const Read& read, const std::filesystem::path& path, Columns& columns) {
  columns.clear();
  const double start = core_seconds();
  columns = read(path);
  return core_seconds() - start;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

bool same_bits(const Columns& a, const Columns& b) {
  const auto same = [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const auto& x, const auto& y) {
    return std::equal(x.begin(), x.end(), y.begin(), y.end(), same);
  });
}

}  // namespace

int main() {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / fmt::format("trundle_csv_{}.csv", ::getpid());
  write_log(path);
  const double megabytes = static_cast<double>(std::filesystem::file_size(path)) / 1e6;
  std::vector<double> ours, theirs, ratio;
  bool same = true;
  for (int round = 0; round < kRounds; ++round) {
    Columns a, b;
    ours.push_back(megabytes / seconds(read_with_trundle, path, a));
    theirs.push_back(megabytes / seconds(read_with_strtod, path, b));
    ratio.push_back(ours.back() / theirs.back());
    same = same && same_bits(a, b);
  }
  std::filesystem::remove(path);
  fmt::print("csv: {:.0f} MB, {} rows of {} numbers, median of {} rounds time on one core\n", megabytes,
             kRows, kColumns, kRounds);
  fmt::print("csv: trundle {:.0f} MB/s, getline + strtod {:.0f} MB/s, ratio {:.2f}, same bits: {}\n",
             median(ours), median(theirs), median(ratio), same ? "yes" : "no");
  return same ? 0 : 1;
}
