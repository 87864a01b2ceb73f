#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/args.h>
#include <fmt/format.h>

#include "trundle/io/words.hpp"
#include "trundle/recording/detail/sentences.hpp"

namespace trundle::recording {
namespace {

constexpr bool has_sentence(std::size_t code) {
  return std::ranges::any_of(sentences::kSentences, [&](const sentences::Sentence& sentence) {
    return static_cast<std::size_t>(sentence.code) == code;
  });
}
static_assert(
    [] {
      std::size_t code = 0;
      while (code < kFindingCodes && has_sentence(code)) ++code;
      return code == kFindingCodes;
    }(),
    "a FindingCode has no sentence in detail/sentences.hpp");

std::string joined(const std::vector<std::string>& names, const std::string& quote, const char* between) {
  std::string text;
  for (const std::string& name : names) {
    if (!text.empty()) text += between;
    text.append(quote).append(name).append(quote);
  }
  return text;
}

/// What stands at the placeholders of a sentence.
class Arguments {
 public:
  template <class Value>
  Arguments& add(const char* name, const Value& value) {
    store_.push_back(fmt::arg(name, value));
    return *this;
  }
  std::string in(std::string_view text) const { return fmt::vformat(text, store_); }

 private:
  fmt::dynamic_format_arg_store<fmt::format_context> store_;
};

Arguments common_arguments(const Finding& finding) {
  const std::vector<std::string>& subjects = finding.subjects;
  Arguments arguments;
  arguments.add("place", finding.place).add("count", finding.count).add("s", finding.count == 1 ? "" : "s");
  arguments.add("subject", subjects.empty() ? std::string() : subjects[0]);
  arguments.add("other", subjects.size() < 2 ? std::string() : subjects[1]);
  arguments.add("subjects", joined(subjects, "", " and ")).add("quoted", joined(subjects, "'", " and "));
  arguments.add("verb_s", subjects.size() == 1 ? "s" : "").add("have", subjects.size() == 1 ? "has" : "have");
  arguments.add("are", subjects.size() == 1 ? "is" : "are");
  return arguments;
}

/// Adds what a payload holds.
struct AddTo {
  Arguments& to;

  void operator()(const std::monostate&) const {}
  void operator()(const payload::Further&) const {}
  void operator()(const payload::Amount& amount) const { to.add("value", amount.value); }
  void operator()(const payload::Times& times) const {
    to.add("factor", times.factor)
        .add("times", three_digits(times.factor))
        .add("root", std::sqrt(times.factor));
  }
  void operator()(const payload::Share& share) const { to.add("factor", share.factor); }
  void operator()(const payload::Range& range) const { to.add("low", range.low).add("high", range.high); }
  void operator()(const payload::Excess& excess) const {
    to.add("farthest", excess.farthest).add("limit", excess.limit).add("all", excess.all);
  }
  void operator()(const payload::Spans& spans) const {
    to.add("start", spans.start_s).add("end", spans.end_s);
    to.add("other_start", spans.other_start_s).add("other_end", spans.other_end_s);
  }
  void operator()(const payload::Names& names) const { to.add("names", joined(names.names, "", ", ")); }
  void operator()(const payload::Disorder& disorder) const {
    to.add("remedy", disorder.is_sorted ? "the rows were sorted" : "rows out of order were left out");
    to.add("question", disorder.is_no_clock ? ": is this the column of the stamps?" : "");
  }
  void operator()(const payload::StampStep& stamps) const {
    to.add("step", stamps.step_s).add("unit", stamps.likely_unit);
  }
  void operator()(const payload::Standstill& still) const {
    to.add("duration", still.duration_s).add("expected", still.expected_m);
  }
  void operator()(const payload::SteadyRate& steady) const {
    to.add("duration", steady.duration_s).add("rate", steady.rate_rad_s);
    to.add("bias", steady.bias_rad_s).add("sigma", steady.sigma_rad_s);
  }
  void operator()(const payload::ClockOffset& clock) const {
    to.add("size", 1e3 * std::abs(clock.off_s)).add("side", clock.off_s < 0.0 ? "late" : "early");
    to.add("sigma", 1e3 * clock.sigma_s);
    const std::string total = fixed(clock.by_map_s + clock.by_robot_s + clock.off_s, 4);
    to.add("remedy",
           clock.map.empty()
               ? fmt::format("write {} = {} under [{}] in {}", clock.key, total, clock.table, clock.file)
               : fmt::format("time_offset_s stands in both {0} ({1}) and {2} ({3}), and they add up: remove "
                             "it from {0}, and write time_offset_s = {4} under [{5}] in {2}",
                             clock.map, fixed(clock.by_map_s, 4), clock.file, fixed(clock.by_robot_s, 4),
                             total, clock.table));
  }
  void operator()(const payload::LengthRatio& ratio) const {
    to.add("times", three_digits(ratio.factor));
    to.add("question",
           ratio.unit.empty()
               ? std::string()
               : fmt::format("is one of them in {} (unit = \"{}\" at its columns in recording.toml)? Else ",
                             ratio.unit, ratio.symbol));
  }
  void operator()(const payload::Stretch& stretch) const {
    to.add("start", stretch.start_s).add("end", stretch.end_s).add("all", stretch.all);
  }
  void operator()(const payload::Offset& offset) const {
    to.add("value", offset.value).add("sigma", offset.sigma).add("of_reading", offset.of_reading);
  }
};

}  // namespace

std::string describe(const Finding& finding) {
  if (std::holds_alternative<payload::Further>(finding.payload))
    return fmt::format("and {} more places of this kind, from here on", finding.count);
  const auto sentence =
      std::ranges::find_if(sentences::kSentences, [&](const sentences::Sentence& candidate) {
        return candidate.code == finding.code && candidate.payload == finding.payload.index();
      });
  if (sentence == std::end(sentences::kSentences)) return std::string(name_of(finding.code));
  Arguments arguments = common_arguments(finding);
  std::visit(AddTo{arguments}, finding.payload);
  return arguments.in(sentence->text);
}

}  // namespace trundle::recording
