#include "trundle/logs/field_reader.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "trundle/logs/detail/field_path.hpp"
#include "trundle/logs/detail/wire.hpp"

namespace trundle::logs {
namespace {

bool says(const Value& value, std::string_view text) {
  if (const auto* const found = std::get_if<std::string_view>(&value)) return *found == text;
  if (const auto* const number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number) == text;
  if (const auto* const number = std::get_if<std::uint64_t>(&value))
    return fmt::format("{}", *number) == text;
  return false;
}

/// One value to find: `take` is false of whoever has had enough.
template <class Take>
bool follow(Wire wire, std::span<const FieldStep> steps, const Take& take);

Value first_value(const Wire& wire, std::span<const FieldStep> steps) {
  Value found;
  follow(wire, steps, [&](const Value& value) {
    found = value;
    return false;
  });
  return found;
}

bool fulfils(const Wire& wire, const std::vector<FieldCondition>& conditions) {
  return std::ranges::all_of(conditions, [&](const FieldCondition& condition) {
    return says(first_value(wire, condition.steps), condition.text);
  });
}

/// What is at the place, an element of the first step's field.
template <class Take>
bool take_element(Wire& wire, std::span<const FieldStep> steps, const Take& take) {
  if (steps.size() == 1) {
    const Value value = wire.take_value(steps.front().target());
    return !wire.is_good() || take(value);
  }
  return follow(wire, steps.subspan(1), take);
}

/// The number of the element at which the array of texts beside a field holds a text.
std::optional<std::uint64_t> index_beside(Wire wire, const FieldStep& step) {
  for (std::size_t i = 0; i < step.sibling; ++i) wire.skip_field(step.structure->fields[i]);
  const LayoutField& names = step.structure->fields[step.sibling];
  const std::uint64_t count = wire.take_count(names);
  for (std::uint64_t i = 0; i < count && wire.is_good(); ++i)
    if (says(wire.take_value(names), step.conditions.front().text)) return i;
  return std::nullopt;
}

template <class Take>
bool take_elements(Wire& wire, std::uint64_t count, std::span<const FieldStep> steps, const Take& take) {
  const FieldStep& step = steps.front();
  for (std::uint64_t i = 0; i < count && wire.is_good(); ++i) {
    if (step.selector == ElementSelector::all || fulfils(wire, step.conditions)) {
      Wire here = wire;
      if (!take_element(here, steps, take)) return false;
      if (step.selector == ElementSelector::by_field) return true;
    }
    wire.skip_elements(step.target(), 1);
  }
  return true;
}

template <class Take>
bool follow(Wire wire, std::span<const FieldStep> steps, const Take& take) {
  const FieldStep& step = steps.front();
  wire.enter(*step.structure);
  const LayoutField& target = step.target();
  std::optional<std::uint64_t> index = step.index;
  if (step.selector == ElementSelector::by_sibling) index = index_beside(wire, step);
  if (!index) return true;
  for (std::size_t i = 0; i < step.field; ++i) wire.skip_field(step.structure->fields[i]);
  if (step.selector == ElementSelector::the_one) return take_element(wire, steps, take);
  const std::uint64_t count = wire.take_count(target);
  if (step.selector == ElementSelector::all || step.selector == ElementSelector::by_field)
    return take_elements(wire, count, steps, take);
  if (*index >= count) return true;
  wire.skip_elements(target, *index);
  return take_element(wire, steps, take);
}

/// Calls the visitor for each value at and below fields.
class FieldVisit {
 public:
  FieldVisit(const Layout& layout, const std::function<void(std::string_view, const Value&)>& visitor)
      : layout_(layout), visitor_(visitor) {}

  void visit_structure(Wire& wire, const LayoutStructure& structure) {
    const std::byte* const outer_end = wire.enter(structure);
    for (const LayoutField& field : structure.fields) {
      if (!wire.is_good()) return;
      if (outer_end != nullptr && wire.left() == 0) break;  // its writer knew no more fields
      if (field.is_padding || has_no_bytes(field))
        wire.skip_field(field);
      else
        visit_field(wire, field);
    }
    wire.leave(outer_end);
  }

 private:
  /// A structure without fields, in however many others.
  bool has_no_bytes(const LayoutField& field) const {
    return field.type == FieldType::structure && layout_.least_size(field.structure) == 0;
  }

  void visit_field(Wire& wire, const LayoutField& field) {
    const std::size_t before = path_.size();
    path_ += field.name;
    if (field.arity == FieldArity::one || Wire::is_text_array(field)) {
      visit_element(wire, field);
    } else {
      const std::uint64_t count = wire.take_count(field);
      const std::size_t name_end = path_.size();
      for (std::uint64_t i = 0; i < count && wire.is_good(); ++i) {
        const fmt::format_int number(i);  // several times as fast as format_to
        path_ += '[';
        path_ += std::string_view(number.data(), number.size());
        path_ += ']';
        visit_element(wire, field);
        path_.resize(name_end);
      }
    }
    path_.resize(before);
  }

  void visit_element(Wire& wire, const LayoutField& field) {
    const bool is_structure = field.type == FieldType::structure;
    const LayoutStructure* const structure = is_structure ? &layout_.structures()[field.structure] : nullptr;
    if (structure == nullptr || structure->is_time) {
      const Value value = wire.take_value(field);
      if (wire.is_good()) visitor_(path_, value);
      return;
    }
    path_ += '.';
    visit_structure(wire, *structure);
  }

  const Layout& layout_;
  const std::function<void(std::string_view, const Value&)>& visitor_;
  std::string path_;
};

}  // namespace

struct FieldReader::Program {
  Layout layout;
  Encoding encoding;
  std::vector<FieldStep> steps = {};  ///< none: log_time
};

FieldReader::FieldReader(const Layout& layout, Encoding encoding, std::string_view path)
    : program_(std::make_unique<Program>(Program{layout, encoding})) {
  const bool is_log_time = path == "log_time";
  if (!is_log_time) program_->steps = compile_path(program_->layout, path);
}

FieldReader::~FieldReader() = default;
FieldReader::FieldReader(FieldReader&&) noexcept = default;
FieldReader& FieldReader::operator=(FieldReader&&) noexcept = default;

Value FieldReader::read(const Message& message) const {
  if (program_->steps.empty()) return message.log_time_ns;
  return first_value(Wire(program_->layout, program_->encoding, message.bytes), program_->steps);
}

void FieldReader::read_all(const Message& message, std::vector<Value>& values) const {
  if (program_->steps.empty()) return values.push_back(message.log_time_ns);
  follow(Wire(program_->layout, program_->encoding, message.bytes), program_->steps, [&](const Value& value) {
    values.push_back(value);
    return true;
  });
}

bool FieldReader::is_repeated() const {
  return std::ranges::any_of(program_->steps,
                             [](const FieldStep& step) { return step.selector == ElementSelector::all; });
}

bool FieldReader::is_time() const {
  if (program_->steps.empty()) return true;
  const LayoutField& field = program_->steps.back().target();
  return field.type == FieldType::time || field.type == FieldType::duration ||
         (field.type == FieldType::structure && program_->layout.structures()[field.structure].is_time);
}

bool FieldReader::is_text() const {
  if (program_->steps.empty()) return false;
  const FieldType type = program_->steps.back().target().type;
  return type == FieldType::string || type == FieldType::character;
}

const std::string& FieldReader::unit() const {
  static const std::string kNone;
  return program_->steps.empty() ? kNone : program_->steps.back().target().unit;
}

std::optional<FieldReader> reader_if_known(const Layout& layout, Encoding encoding, std::string_view path) {
  try {
    return FieldReader(layout, encoding, path);
  } catch (const UnknownField&) {
    return std::nullopt;
  }
}

bool visit(const Layout& layout, Encoding encoding, std::span<const std::byte> bytes,
           const std::function<void(std::string_view path, const Value&)>& visitor) {
  Wire wire(layout, encoding, bytes);
  FieldVisit(layout, visitor).visit_structure(wire, layout.root());
  return wire.is_good();
}

}  // namespace trundle::logs
