#include "trundle/logs/layout.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "trundle/logs/detail/wire.hpp"

namespace trundle::logs {
namespace {

std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  return b != 0 && a > kMost / b ? kMost : a * b;
}

std::uint64_t plus(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  return a > kMost - b ? kMost : a + b;
}

void append_paths(const Layout& layout, const LayoutStructure& structure, const std::string& before,
                  std::vector<std::string>& paths) {
  constexpr std::size_t kMostPaths = 4096;  // more than anyone chooses from
  for (const LayoutField& field : structure.fields) {
    if (field.is_padding || paths.size() >= kMostPaths) continue;
    const bool is_structure = field.type == FieldType::structure;
    if (is_structure && layout.least_size(field.structure) == 0) continue;
    const bool is_one = field.arity == FieldArity::one || Wire::is_text_array(field);
    const std::string path = before + field.name + (is_one ? "" : "[]");
    if (is_structure && !layout.structures()[field.structure].is_time)
      append_paths(layout, layout.structures()[field.structure], path + ".", paths);
    else
      paths.push_back(path);
  }
}

}  // namespace

Layout::Layout(std::vector<LayoutStructure> structures, std::size_t deepest)
    : structures_(std::move(structures)) {
  if (structures_.empty()) throw BadDefinition("no structure is defined");
  std::vector<std::size_t> depths;
  for (std::size_t i = 0; i < structures_.size(); ++i) {
    std::uint64_t least = 0;
    std::size_t depth = 1;
    for (const LayoutField& field : structures_[i].fields) {
      const bool is_structure = field.type == FieldType::structure;
      if (is_structure && field.structure >= i)
        throw BadDefinition(fmt::format("{} contains itself, or what is not defined", structures_[i].name));
      if (is_structure) depth = std::max(depth, depths[field.structure] + 1);
      const std::uint64_t element = is_structure ? least_sizes_[field.structure] : bytes_of(field.type);
      const bool is_counted = field.arity == FieldArity::one || field.arity == FieldArity::fixed;
      const std::uint64_t size = is_counted ? times(element, field.arity == FieldArity::one ? 1 : field.count)
                                            : (field.arity == FieldArity::dynamic ? 4 : 0);
      if (!field.keeps_place) least = plus(least, size);
    }
    if (depth > deepest)
      throw BadDefinition(fmt::format("{} nests deeper than {} structures", structures_[i].name, deepest));
    depths.push_back(depth);
    least_sizes_.push_back(least);
  }
}

std::vector<std::string> Layout::paths() const {
  std::vector<std::string> paths;
  append_paths(*this, root(), "", paths);
  return paths;
}

std::optional<double> number_of(const Value& value) {
  if (const auto* const number = std::get_if<double>(&value)) return *number;
  if (const auto* const number = std::get_if<std::int64_t>(&value)) return static_cast<double>(*number);
  if (const auto* const number = std::get_if<std::uint64_t>(&value)) return static_cast<double>(*number);
  return std::nullopt;
}

}  // namespace trundle::logs
