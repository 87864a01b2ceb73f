#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/logs/field_reader.hpp"

namespace trundle::logs {

enum class ElementSelector {
  the_one,     ///< no array
  index,       ///< an element by its number
  all,         ///< each of them
  by_field,    ///< the first structure whose fields are these
  by_sibling,  ///< where the array of texts beside it holds this text
};

struct FieldStep;

/// What a field below an element must say.
struct FieldCondition {
  std::vector<FieldStep> steps;
  std::string text;
};

/// From a structure to one of its fields, and to an element of it.
struct FieldStep {
  const LayoutStructure* structure = nullptr;
  std::size_t field = 0;
  ElementSelector selector = ElementSelector::the_one;
  std::uint64_t index = 0;
  std::vector<FieldCondition> conditions = {};
  std::size_t sibling = 0;  ///< of by_sibling: whose only condition has no steps

  const LayoutField& target() const { return structure->fields[field]; }
};

/// A path of FieldReader through a layout, which must stay where it is. Throws UnknownField.
[[nodiscard]] std::vector<FieldStep> compile_path(const Layout& layout, std::string_view path);

}  // namespace trundle::logs
