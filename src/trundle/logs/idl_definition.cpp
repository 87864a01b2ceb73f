#include <cctype>
#include <charconv>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/logs/detail/raw_types.hpp"

namespace trundle::logs {
namespace {

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}

/// The words and signs of a text; comments, #include lines and annotations are none.
class IdlTokens {
 public:
  explicit IdlTokens(std::string_view text) : rest_(text) { advance(); }

  [[nodiscard]] const std::string& peek() const { return token_; }
  [[nodiscard]] bool is_end() const { return token_.empty(); }
  /// Those before the token that is next: "appendable", "extensibility(APPENDABLE)".
  std::vector<std::string> take_annotations() { return std::exchange(annotations_, {}); }
  std::string take() {
    std::string token = std::move(token_);
    advance();
    return token;
  }
  bool take_if(std::string_view wanted) {
    if (token_ != wanted) return false;
    advance();
    return true;
  }
  void expect(std::string_view wanted) {
    if (!take_if(wanted)) throw BadDefinition(fmt::format("'{}' stands where '{}' should", token_, wanted));
  }

 private:
  void advance() {
    for (;;) {
      skip_blank();
      if (!rest_.starts_with('@')) break;
      rest_.remove_prefix(1);
      std::string annotation = take_raw();
      while (rest_.starts_with("::")) {
        rest_.remove_prefix(2);
        annotation = take_raw();
      }
      skip_blank();
      if (rest_.starts_with('(')) annotation += take_parentheses();
      annotations_.push_back(std::move(annotation));
    }
    token_ = take_raw();
  }

  void skip_blank() {
    for (;;) {
      while (!rest_.empty() && std::isspace(static_cast<unsigned char>(rest_.front())) != 0)
        rest_.remove_prefix(1);
      if (rest_.starts_with("//") || rest_.starts_with('#')) {
        rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
      } else if (rest_.starts_with("/*")) {
        const std::size_t end = rest_.find("*/", 2);
        rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 2);
      } else {
        return;
      }
    }
  }

  std::string take_parentheses() {
    std::size_t depth = 0;
    std::string text;
    do {
      const std::string token = take_raw();
      text += token;
      if (token.empty()) throw BadDefinition("an annotation does not end");
      if (token == "(") ++depth;
      if (token == ")") --depth;
      skip_blank();
    } while (depth > 0);
    return text;
  }

  std::string take_raw() {
    if (rest_.empty()) return {};
    std::size_t size = 1;
    if (const char quote = rest_.front(); quote == '"' || quote == '\'') {
      while (size < rest_.size() && rest_[size] != quote) size += rest_[size] == '\\' ? 2 : 1;
      size = std::min(size + 1, rest_.size());
    } else if (rest_.starts_with("::")) {
      size = 2;
    } else if (is_word(rest_.front())) {
      while (size < rest_.size() && is_word(rest_[size])) ++size;
    }
    std::string token(rest_.substr(0, size));
    rest_.remove_prefix(size);
    return token;
  }

  std::string_view rest_;
  std::string token_;
  std::vector<std::string> annotations_;
};

constexpr std::array<std::pair<std::string_view, FieldType>, 22> kIdlTypes = {{
    {"boolean", FieldType::boolean},     {"octet", FieldType::uint8},
    {"char", FieldType::uint8},          {"int8", FieldType::int8},
    {"uint8", FieldType::uint8},         {"short", FieldType::int16},
    {"int16", FieldType::int16},         {"unsigned short", FieldType::uint16},
    {"uint16", FieldType::uint16},       {"long", FieldType::int32},
    {"int32", FieldType::int32},         {"unsigned long", FieldType::uint32},
    {"uint32", FieldType::uint32},       {"long long", FieldType::int64},
    {"int64", FieldType::int64},         {"unsigned long long", FieldType::uint64},
    {"uint64", FieldType::uint64},       {"float", FieldType::float32},
    {"double", FieldType::float64},      {"string", FieldType::string},
    {"wstring", FieldType::wide_string}, {"wchar", FieldType::uint16},
}};

class IdlParser {
 public:
  IdlParser(std::string_view text, RawTypes& types) : tokens_(text), types_(types) {}

  void parse() {
    while (!tokens_.is_end()) parse_declaration();
  }

 private:
  void parse_declaration() {
    const std::vector<std::string> annotations = tokens_.take_annotations();
    if (tokens_.take_if(";")) return;
    if (tokens_.take_if("module")) return parse_module();
    if (tokens_.take_if("struct")) return parse_struct(extensibility_in(annotations));
    if (tokens_.take_if("typedef")) return parse_typedef();
    if (tokens_.take_if("enum")) {
      for (const std::string& annotation : annotations)
        if (annotation.starts_with("bit_bound")) throw BadDefinition("an enum of another size than 32 bits");
      return parse_enum();
    }
    if (tokens_.take_if("const")) return skip_to_semicolon();
    throw BadDefinition(fmt::format("'{}' is no declaration that ROS 2 writes", tokens_.peek()));
  }

  void parse_module() {
    if (scope_.size() >= Layout::kDeepest) throw BadDefinition("modules nest too deep");
    scope_.push_back(tokens_.take());
    tokens_.expect("{");
    while (!tokens_.take_if("}")) {
      if (tokens_.is_end()) throw BadDefinition(fmt::format("module {} does not end", scope_.back()));
      parse_declaration();
    }
    scope_.pop_back();
  }

  static Extensibility extensibility_in(const std::vector<std::string>& annotations) {
    for (const std::string& annotation : annotations) {
      if (annotation == "final" || annotation == "extensibility(FINAL)") return Extensibility::final;
      if (annotation == "appendable" || annotation == "extensibility(APPENDABLE)")
        return Extensibility::appendable;
      if (annotation == "mutable" || annotation == "extensibility(MUTABLE)")
        throw BadDefinition("a struct is mutable: parameter lists are not read");
    }
    return Extensibility::unspecified;
  }

  void parse_struct(Extensibility extensibility) {
    const std::string name = full_name(tokens_.take());
    RawType type;
    type.extensibility = extensibility;
    tokens_.expect("{");
    while (!tokens_.take_if("}")) {
      if (tokens_.is_end()) throw BadDefinition(fmt::format("struct {} does not end", name));
      parse_members(type.fields);
    }
    types_.try_emplace(name, std::move(type));
  }

  void parse_members(std::vector<RawField>& fields) {
    for (const std::string& annotation : tokens_.take_annotations())
      if (annotation == "optional" || annotation == "optional(TRUE)" || annotation == "optional(true)")
        throw BadDefinition("a member is optional: whether it is there is not read");
    const RawField type = parse_type();
    do {
      RawField field = type;
      field.field.name = tokens_.take();
      parse_dimension(field);
      fields.push_back(std::move(field));
    } while (tokens_.take_if(","));
    tokens_.expect(";");
  }

  void parse_typedef() {
    RawField type = parse_type();
    const std::string name = full_name(tokens_.take());
    parse_dimension(type);
    tokens_.expect(";");
    aliases_.insert_or_assign(name, std::move(type));
  }

  void parse_enum() {
    const std::string name = full_name(tokens_.take());
    while (!tokens_.is_end() && !tokens_.take_if("}")) tokens_.take();
    RawField number;
    number.field.type = FieldType::uint32;
    aliases_.insert_or_assign(name, number);
  }

  void skip_to_semicolon() {
    while (!tokens_.is_end() && !tokens_.take_if(";")) tokens_.take();
  }

  void parse_dimension(RawField& field) {
    while (tokens_.take_if("[")) {
      const std::uint32_t count = parse_number();
      tokens_.expect("]");
      LayoutField& layout = field.field;
      const bool is_plain = layout.arity == FieldArity::one || layout.arity == FieldArity::fixed;
      if (!is_plain || (layout.count != 0 && count > kMostElements / layout.count))
        throw BadDefinition("an array of arrays, or too long");
      layout.count *= count;
      layout.arity = FieldArity::fixed;
    }
  }

  std::uint32_t parse_number() {
    const std::string text = tokens_.take();
    std::uint32_t number = 0;
    const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || stopped != text.data() + text.size())
      throw BadDefinition(fmt::format("'{}' is no length", text));
    return number;
  }

  RawField parse_type() {
    if (tokens_.take_if("sequence")) {
      tokens_.expect("<");
      if (++depth_ > 2) throw BadDefinition("a sequence of sequences");
      RawField field = parse_type();
      --depth_;
      if (field.field.arity != FieldArity::one) throw BadDefinition("a sequence of arrays");
      field.field.arity = FieldArity::dynamic;
      if (tokens_.take_if(",")) parse_number();
      tokens_.expect(">");
      return field;
    }
    return parse_name();
  }

  RawField parse_name() {
    std::string name = tokens_.take();
    while (name == "unsigned" || name == "unsigned long" || name == "long") {
      const std::string& next = tokens_.peek();
      if (next != "long" && next != "short" && next != "double") break;
      name += fmt::format(" {}", tokens_.take());
    }
    for (const auto& [plain, type] : kIdlTypes) {
      if (plain != name) continue;
      RawField field;
      field.field.type = type;
      if (tokens_.take_if("<")) {  // the bound of a string
        parse_number();
        tokens_.expect(">");
      }
      return field;
    }
    while (tokens_.take_if("::")) name += (name.empty() ? "" : "::") + tokens_.take();
    return named(name);
  }

  /// A type of a name as it is written: looked for in the modules around, from the inside out.
  RawField named(const std::string& name) const {
    const std::string sought = short_type_name(name);
    for (std::size_t depth = scope_.size() + 1; depth-- > 0;) {
      const std::string prefix = fmt::format(
          "{}", fmt::join(scope_.begin(), scope_.begin() + static_cast<std::ptrdiff_t>(depth), "::"));
      const std::string full = short_type_name(prefix.empty() ? name : prefix + "::" + name);
      if (const auto alias = aliases_.find(full); alias != aliases_.end()) return alias->second;
      if (types_.contains(full)) return structure(full);
    }
    return structure(sought);
  }

  static RawField structure(const std::string& name) {
    RawField field;
    field.field.type = FieldType::structure;
    field.structure = name;
    return field;
  }

  std::string full_name(const std::string& name) const {
    return short_type_name(fmt::format("{}{}{}", fmt::join(scope_, "::"), scope_.empty() ? "" : "::", name));
  }

  static constexpr std::uint32_t kMostElements = 1U << 30;

  IdlTokens tokens_;
  RawTypes& types_;
  std::vector<std::string> scope_;
  std::map<std::string, RawField, std::less<>> aliases_;
  int depth_ = 0;  ///< of sequences
};

}  // namespace

Layout parse_ros2idl(std::string_view type, std::string_view definition) {
  RawTypes types;
  for (const DefinitionSection& section : sections_of(type, definition))
    IdlParser(section.text, types).parse();
  return resolve(std::move(types), type, true);
}

}  // namespace trundle::logs
