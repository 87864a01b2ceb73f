#include "trundle/slam/association/landmark_table.hpp"

#include <algorithm>

namespace trundle::slam {

void LandmarkTable::add_identified(LandmarkId id) {
  if (const int other = with_id(id); other != kNone) entry(other).id = next_unidentified_++;
  next_unidentified_ = std::max(next_unidentified_, id + 1);
  identified_[id] = static_cast<int>(entries_.size());
  entries_.push_back({.id = id, .is_identified = true});
}

void LandmarkTable::add_unidentified(const Vector2& place, const Vector2& viewpoint) {
  grid_.put(entries_.size(), place);
  entries_.push_back({.id = next_unidentified_++, .existence = {.last_viewpoint = viewpoint}});
}

void LandmarkTable::remove(int landmark) {
  const auto number = static_cast<std::size_t>(landmark);
  const std::size_t last = entries_.size() - 1;
  grid_.remove(number);
  if (number != last) {
    entries_[number] = entries_.back();
    if (is_identified(landmark)) identified_[id_of(landmark)] = landmark;
    if (grid_.contains(last)) {
      grid_.put(number, grid_.place(last));
      grid_.remove(last);
    }
  }
  entries_.pop_back();
}

bool LandmarkTable::is_confirmed(int landmark) const {
  return is_identified(landmark) || entry(landmark).existence.is_confirmed(visibility_);
}

int LandmarkTable::with_id(LandmarkId id) const {
  const auto found = std::ranges::find(entries_, id, &Entry::id);
  return found == entries_.end() ? kNone : static_cast<int>(found - entries_.begin());
}

int LandmarkTable::identified(LandmarkId id) const {
  const auto found = identified_.find(id);
  return found == identified_.end() ? kNone : found->second;
}

void LandmarkTable::note_moved(int landmark, const Vector2& place) {
  const auto number = static_cast<std::size_t>(landmark);
  if (grid_.contains(number)) off_grid_m_ = std::max(off_grid_m_, (place - grid_.place(number)).norm());
}

}  // namespace trundle::slam
