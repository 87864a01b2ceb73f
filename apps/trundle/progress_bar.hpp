#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "command.hpp"

namespace trundle::app {

/// What is being done, how fast, and how long it will take: one line on stderr, where that is a terminal and
/// --quiet was not given. Gone as soon as something else is to be printed.
class ProgressBar {
 public:
  explicit ProgressBar(const Common& common);
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void begin(std::string task);
  void update(std::size_t done, std::size_t of);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  bool shown_;
  bool drawn_any_ = false;
  std::string task_;
  Clock::time_point begin_;
  Clock::time_point drawn_;
};

}  // namespace trundle::app
