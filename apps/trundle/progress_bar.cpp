#include "progress_bar.hpp"

#include <cmath>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include "trundle/io/words.hpp"

namespace trundle::app {
namespace {

constexpr std::chrono::milliseconds kBetweenDrawings{100};
constexpr std::size_t kWidth = 24;  // characters: the numbers beside it take 43 more of a terminal's 80

void draw(const std::string& text) {
  print_error(fmt::format("\r\x1b[K{}", one_line(text)));
}

std::string time_text(double seconds) {
  if (seconds < 60.0) return fmt::format("{:.0f} s", seconds);
  return fmt::format("{:.0f} min {:02.0f} s", std::floor(seconds / 60.0), std::fmod(seconds, 60.0));
}

}  // namespace

ProgressBar::ProgressBar(const Common& common) : shown_(isatty(STDERR_FILENO) == 1 && !common.quiet) {}

void ProgressBar::begin(std::string task) {
  if (!shown_) return;
  task_ = std::move(task);
  begin_ = drawn_ = Clock::now();
  draw(task_ + " ...");
  drawn_any_ = true;
}

void ProgressBar::update(std::size_t done, std::size_t of) {
  if (!shown_ || of == 0) return;
  const auto now = Clock::now();
  if (now - drawn_ < kBetweenDrawings) return;
  drawn_ = now;
  const double share = static_cast<double>(done) / static_cast<double>(of);
  const double spent_s = std::chrono::duration<double>(now - begin_).count();
  const auto full = static_cast<std::size_t>(share * static_cast<double>(kWidth));
  draw(fmt::format("{} [{:#<{}}{:.<{}}] {:3.0f} %, {:.0f} steps/s, {} left", task_, "", full, "",
                   kWidth - full, 100.0 * share, static_cast<double>(done) / spent_s,
                   time_text(spent_s * (1.0 - share) / share)));
}

void ProgressBar::clear() {
  if (drawn_any_) draw("");
  drawn_any_ = false;
}

}  // namespace trundle::app
