// WPILib's packed struct serialization 1.0: declarations as in C, without padding, bit-fields from the lowest
// bit. https://github.com/wpilibsuite/allwpilib/blob/main/wpiutil/doc/struct.adoc
#include "trundle/logs/detail/wpilib_struct.hpp"

#include <array>
#include <charconv>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "trundle/logs/definitions.hpp"

namespace trundle::logs {
namespace {

constexpr std::string_view kBlank = " \t\r\n";

std::string_view without_blanks(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlank);
  return begin == std::string_view::npos ? std::string_view{}
                                         : text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

struct WpilibType {
  std::string_view name;
  FieldType type;
  std::uint8_t bits;  ///< 0: cannot be a bit-field
};
constexpr std::array<WpilibType, 14> kWpilibTypes = {{{"bool", FieldType::boolean, 8},
                                                      {"char", FieldType::character, 0},
                                                      {"int8", FieldType::int8, 8},
                                                      {"int16", FieldType::int16, 16},
                                                      {"int32", FieldType::int32, 32},
                                                      {"int64", FieldType::int64, 64},
                                                      {"uint8", FieldType::uint8, 8},
                                                      {"uint16", FieldType::uint16, 16},
                                                      {"uint32", FieldType::uint32, 32},
                                                      {"uint64", FieldType::uint64, 64},
                                                      {"float", FieldType::float32, 0},
                                                      {"float32", FieldType::float32, 0},
                                                      {"double", FieldType::float64, 0},
                                                      {"float64", FieldType::float64, 0}}};

const WpilibType* wpilib_type(std::string_view name) {
  for (const WpilibType& type : kWpilibTypes)
    if (type.name == name) return &type;
  return nullptr;
}

/// An unsigned integer of so many bits: what a flag lies in.
FieldType unsigned_of(unsigned bits) {
  return bits == 8    ? FieldType::uint8
         : bits == 16 ? FieldType::uint16
         : bits == 32 ? FieldType::uint32
                      : FieldType::uint64;
}

/// "int16 name[4]", "enum {a=1} int8 name : 2" in its parts.
struct Declaration {
  std::string_view type;
  std::string_view name;
  std::optional<std::uint32_t> elements;
  std::optional<std::uint32_t> bits;
};

[[noreturn]] void refuse(std::string_view declaration) {
  throw BadDefinition(fmt::format("'{}' declares no member of a structure", declaration));
}

std::uint32_t count_in(std::string_view text, std::string_view declaration) {
  text = without_blanks(text);
  std::uint32_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end != text.data() + text.size() || count == 0) refuse(declaration);
  return count;
}

Declaration declaration_in(std::string_view text) {
  const std::string_view whole = text;
  if (const std::size_t enumeration = text.find('}'); enumeration != std::string_view::npos)
    text = without_blanks(text.substr(enumeration + 1));
  Declaration declaration;
  if (const std::size_t at = text.find(':'); at != std::string_view::npos) {
    declaration.bits = count_in(text.substr(at + 1), whole);
    text = without_blanks(text.substr(0, at));
  } else if (const std::size_t open = text.find('['); open != std::string_view::npos) {
    if (!text.ends_with(']')) refuse(whole);
    declaration.elements = count_in(text.substr(open + 1, text.size() - open - 2), whole);
    text = without_blanks(text.substr(0, open));
  }
  const std::size_t gap = text.find_first_of(kBlank);
  if (gap == std::string_view::npos) refuse(whole);
  declaration.type = text.substr(0, gap);
  declaration.name = without_blanks(text.substr(gap));
  if (declaration.name.find_first_of(kBlank) != std::string_view::npos) refuse(whole);
  return declaration;
}

class WpilibStructs {
 public:
  explicit WpilibStructs(const WpilibSchemas& schemas) : schemas_(schemas) {}

  /// The index of a structure, after those that it contains.
  std::uint32_t add(const std::string& name) {
    if (const auto known = index_of_.find(name); known != index_of_.end()) return known->second;
    const auto schema = schemas_.find(name);
    if (schema == schemas_.end()) throw BadDefinition(fmt::format("the log has no schema of '{}'", name));
    if (!open_.insert(name).second) throw BadDefinition(fmt::format("'{}' contains itself", name));
    if (open_.size() > Layout::kDeepest) throw BadDefinition("structures nest too deep");
    LayoutStructure structure{.name = name, .fields = {}};
    std::string_view rest = schema->second;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(';'), rest.size());
      if (const std::string_view text = without_blanks(rest.substr(0, end)); !text.empty())
        add_field(declaration_in(text), structure.fields);
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    close_bits();
    open_.erase(name);
    structures_.push_back(std::move(structure));
    return index_of_[name] = static_cast<std::uint32_t>(structures_.size() - 1);
  }
  std::vector<LayoutStructure> take() { return std::move(structures_); }

 private:
  /// The integer in which the last bit-field lies.
  struct Storage {
    unsigned width = 0;  ///< 0: none is open
    unsigned used = 0;
  };

  void close_bits() { storage_ = {}; }

  void add_field(const Declaration& declaration, std::vector<LayoutField>& fields) {
    const WpilibType* const type = wpilib_type(declaration.type);
    if (declaration.bits) return add_bits(declaration, type, fields);
    close_bits();
    LayoutField field{.name = std::string(declaration.name)};
    if (type != nullptr) {
      field.type = type->type;
    } else {
      field.type = FieldType::structure;
      field.structure = add(std::string(declaration.type));
      close_bits();
    }
    if (declaration.elements || field.type == FieldType::character) {
      field.arity = FieldArity::fixed;
      field.count = declaration.elements.value_or(1);
    }
    fields.push_back(std::move(field));
  }

  void add_bits(const Declaration& declaration, const WpilibType* type, std::vector<LayoutField>& fields) {
    if (type == nullptr || type->bits == 0 || *declaration.bits > type->bits) refuse(declaration.name);
    const bool is_flag = type->type == FieldType::boolean;
    if (is_flag && *declaration.bits != 1) refuse(declaration.name);
    const bool same = storage_.width != 0 && (is_flag || storage_.width == type->bits);
    if (same && storage_.used + *declaration.bits <= storage_.width)
      fields.back().keeps_place = true;
    else
      storage_ = {.width = type->bits, .used = 0};
    LayoutField field{.name = std::string(declaration.name)};
    field.type = is_flag ? unsigned_of(storage_.width) : type->type;
    field.bits = static_cast<std::uint8_t>(*declaration.bits);
    field.first_bit = static_cast<std::uint8_t>(storage_.used);
    storage_.used += *declaration.bits;
    fields.push_back(std::move(field));
  }

  const WpilibSchemas& schemas_;
  std::vector<LayoutStructure> structures_;
  std::map<std::string, std::uint32_t> index_of_;
  std::set<std::string> open_;
  Storage storage_;
};

}  // namespace

Layout layout_of_wpilib_struct(std::string_view name, bool is_array, const WpilibSchemas& schemas) {
  WpilibStructs structs(schemas);
  const std::uint32_t structure = structs.add(std::string(name));
  std::vector<LayoutStructure> structures = structs.take();
  if (is_array) {
    LayoutField value{.name = "value", .type = FieldType::structure, .arity = FieldArity::rest};
    value.structure = structure;
    structures.push_back({.name = std::string(name) + "[]", .fields = {std::move(value)}});
  }
  return Layout(std::move(structures));
}

}  // namespace trundle::logs
