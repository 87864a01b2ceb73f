#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <nlohmann/json.hpp>

#include "trundle/report/result_parts.hpp"
#include "trundle/slip/event.hpp"
#include "trundle/statistics/magnitude.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostAnswers = 5;  // tiles: a row of the page's first screen
/// A parameter so many standard deviations away from nominal, or a mean so far from what is expected, is
/// worth a sentence.
constexpr double kFarSigmas = 3.0;
constexpr double kHonestShare = 0.8;  ///< of poses inside their 95 %
constexpr double kHonestNis = 1.5;    ///< times what is expected

const Json* parameter_named(const Json& calibration, const std::string& name) {
  for (const Json& parameter : calibration.at("parameters"))
    if (parameter.at("name") == name && parameter.at("observable") == true) return &parameter;
  return nullptr;
}

double correlation_of(const Json& calibration, const std::string& a, const std::string& b) {
  const Json& correlation = calibration.at("correlation");
  const Json& names = correlation.at("names");
  const auto index = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(names, Json(name)) - names.begin());
  };
  const std::size_t i = index(a), j = index(b);
  if (i >= names.size() || j >= names.size() || correlation.at("total").empty()) return 0.0;
  const Json& rho = correlation.at("total")[i][j];
  return rho.is_number() ? rho.get<double>() : 0.0;
}

double number_or_zero(const Json& value) {
  return value.is_number() ? value.get<double>() : 0.0;
}

/// One wheel of two [m].
struct Diameter {
  std::string wheel;
  double value, sigma, nominal;
};

struct Diameters {
  Diameter first, second;
  double correlation;
};

std::optional<Diameter> diameter_of(const Json& calibration, const std::string& wheel) {
  const Json* found = parameter_named(calibration, wheel + ".diameter");
  if (found == nullptr) return std::nullopt;
  return Diameter{wheel, number_or_zero(found->at("value")), number_or_zero(found->at("sigma_total")),
                  number_or_zero(found->at("nominal"))};
}

/// Of a robot with two wheels, both of them estimated.
std::optional<Diameters> diameters_of(const Json& calibration) {
  const Json& wheels = calibration.at("robot").value("wheels", Json::array());
  if (wheels.size() != 2) return std::nullopt;
  const auto first = diameter_of(calibration, wheels[0]), second = diameter_of(calibration, wheels[1]);
  if (!first || !second) return std::nullopt;
  const double rho = correlation_of(calibration, first->wheel + ".diameter", second->wheel + ".diameter");
  return Diameters{*first, *second, rho};
}

Json diameter_json(const Diameter& d) {
  return {{"wheel", d.wheel}, {"value", d.value}, {"sigma", d.sigma}, {"nominal", d.nominal}};
}

/// How much larger the second of two wheels is than the first, as a share, now and as configured:
/// σ² = (D2/D1)² (σ1²/D1² + σ2²/D2² − 2 ρ σ1 σ2 / (D1 D2)).
Json wheel_ratio(const Json& calibration) {
  const auto wheels = diameters_of(calibration);
  if (!wheels) return nullptr;
  const auto& [a, b, rho] = *wheels;
  const double r1 = a.sigma / a.value, r2 = b.sigma / b.value;
  const double ratio = b.value / a.value, nominal = b.nominal / a.nominal;
  const double sigma = ratio * std::sqrt(std::max(0.0, r1 * r1 + r2 * r2 - 2.0 * rho * r1 * r2));
  if (!(sigma > 0.0) || !std::isfinite(nominal)) return nullptr;
  return {{"kind", "wheel_ratio"},
          {"first", a.wheel},
          {"second", b.wheel},
          {"value", ratio - 1.0},
          {"sigma", sigma},
          {"nominal", nominal - 1.0},
          {"sigmas_from_nominal", (ratio - nominal) / sigma},
          {"diameters_m", {diameter_json(a), diameter_json(b)}}};
}

/// How much larger two wheels N1, N2 are than configured in the mean, s = ½ (D1/N1 + D2/N2) − 1:
/// σ² = ¼ (σ1²/N1² + σ2²/N2² + 2 ρ σ1 σ2 / (N1 N2)).
Json wheel_scale(const Json& calibration) {
  const auto wheels = diameters_of(calibration);
  if (!wheels) return nullptr;
  const auto& [a, b, rho] = *wheels;
  const double r1 = a.sigma / a.nominal, r2 = b.sigma / b.nominal;
  const double scale = 0.5 * (a.value / a.nominal + b.value / b.nominal) - 1.0;
  const double sigma = 0.5 * std::sqrt(std::max(0.0, r1 * r1 + r2 * r2 + 2.0 * rho * r1 * r2));
  if (!(sigma > 0.0) || !std::isfinite(scale)) return nullptr;
  return {{"kind", "wheel_scale"},
          {"value", scale},
          {"sigma", sigma},
          {"sigmas_from_nominal", scale / sigma},
          {"diameters_m", {diameter_json(a), diameter_json(b)}}};
}

/// What a length was estimated in proportion to: the diameters and, where the gyro took part, its scale, as
/// far as they were not estimated with it.
Json taken_as_exact(const Json& calibration) {
  Json names = Json::array();
  const auto add_unless_free = [&](const std::string& name) {
    if (parameter_named(calibration, name) == nullptr) names.push_back(name);
  };
  for (const Json& wheel : calibration.at("robot").value("wheels", Json::array()))
    add_unless_free(wheel.get<std::string>() + ".diameter");
  const bool has_gyro = std::ranges::any_of(calibration.at("parameters"), [](const Json& parameter) {
    return parameter.at("name").get<std::string>().starts_with("gyro.");
  });
  if (has_gyro) add_unless_free("gyro.scale");
  return names;
}

Json parameter_answer(const Json& calibration, const std::string& name) {
  const Json* parameter = parameter_named(calibration, name);
  if (parameter == nullptr) return nullptr;
  return {{"kind", "parameter"},
          {"name", name},
          {"unit", parameter->at("unit")},
          {"value", parameter->at("value")},
          {"sigma", parameter->at("sigma_total")},
          {"nominal", parameter->at("nominal")},
          {"sigmas_from_nominal", parameter->at("sigmas_from_nominal")},
          {"taken_as_exact", parameter->at("unit") == "m" ? taken_as_exact(calibration) : Json::array()}};
}

/// The first parameter that is no diameter of the pair whose ratio is told already.
Json other_parameter(const Json& calibration) {
  for (const Json& parameter : calibration.at("parameters")) {
    const std::string name = parameter.at("name");
    if (parameter.at("observable") == true && !name.ends_with(".diameter"))
      return parameter_answer(calibration, name);
  }
  return nullptr;
}

Json calibration_errors(const Json& calibration) {
  const Json& errors = calibration.at("errors");
  const bool held_out = errors.at("hold_out").is_object();
  const Json& group = errors.at(held_out ? "hold_out" : "training");
  if (!group.is_object()) return nullptr;
  return {
      {"kind", "calibration_error"},
      {"held_out", held_out},
      {"runs", group.at("runs")},
      {"before_m", group.at("before").at("position_rms_m")},
      {"after_m", group.at("after").is_object() ? group.at("after").at("position_rms_m") : Json(nullptr)}};
}

const Json* error_of(const Json& result, const std::vector<std::string>& roles) {
  for (const std::string& role : roles)
    for (const Json& error : result.at("errors"))
      if (error.at("role") == role) return &error;
  return nullptr;
}

Json track_error(const Json& result) {
  const Json* best = error_of(
      result, {"result", "smoothed", "path", "online", "localized", "corrected", "odometry", "other"});
  const Json* before = error_of(result, {"nominal", "odometry"});
  if (best == nullptr) best = before;
  if (best == nullptr) return nullptr;
  const auto rms = [](const Json& error) { return error.at("summary").at("position_rms_m"); };
  return {{"kind", "track_error"},
          {"role", best->at("role")},
          {"before_role", before == nullptr || before == best ? Json(nullptr) : before->at("role")},
          {"before_m", before == nullptr || before == best ? Json(nullptr) : rms(*before)},
          {"after_m", rms(*best)},
          {"path_m", best->at("summary").at("path_m")},
          {"share_inside_95", best->at("summary").at("share_inside_95")}};
}

/// Where the file does not say how clear a slip is, it counts.
bool counts_as_clear(const Json& event) {
  const Json by_chance = event.value("by_chance", Json(nullptr));
  return !by_chance.is_number() || is_clear(by_chance.get<double>());
}

/// Of slips that are clear; how many were found in all.
Json slip_answer(const Json& result) {
  const Json& slip = result.at("slip");
  if (slip.is_null()) return nullptr;
  std::size_t clear = 0;
  double lost_m = 0.0;
  double variance_m2 = 0.0;  // NaN: an event does not hold it
  std::map<std::string, double> by_wheel;
  for (const Json& event : slip.at("events")) {
    if (!counts_as_clear(event)) continue;
    ++clear;
    const Json given = event.value("excess_sigma_m", Json(nullptr));
    const double sigma_m = given.is_number() ? given.get<double>() : std::nan("");
    const double excess_m = number_or_zero(event.at("excess_m"));
    const double excess = std::isnan(sigma_m) ? std::abs(excess_m) : magnitude(excess_m, sigma_m);
    lost_m += excess;
    variance_m2 += sigma_m * sigma_m;
    by_wheel[event.at("wheel")] += excess;
  }
  by_wheel.erase("ambiguous");
  const auto worst = std::ranges::max_element(by_wheel, {}, &std::pair<const std::string, double>::second);
  return {{"kind", "slip"},
          {"count", clear},
          {"unclear", slip.at("events").size() - clear},
          {"excess_m", lost_m},
          {"excess_sigma_m", std::isnan(variance_m2) ? Json(nullptr) : Json(std::sqrt(variance_m2))},
          {"worst_wheel", worst == by_wheel.end() ? Json(nullptr) : Json(worst->first)},
          {"worst_share",
           worst == by_wheel.end() || lost_m == 0.0 ? Json(nullptr) : Json(worst->second / lost_m)}};
}

Json map_answer(const Json& result) {
  const Json& map = result.at("map");
  if (map.is_null() || map.at("landmarks").empty()) return nullptr;
  std::vector<double> axes;
  for (const Json& landmark : map.at("landmarks"))
    if (landmark.at("ellipse95").is_object()) axes.push_back(landmark.at("ellipse95").at("semi_major_m"));
  return {{"kind", "map"},
          {"landmarks", map.at("landmarks").size()},
          {"median95_m", axes.empty() ? Json(nullptr) : Json(median(std::move(axes)))}};
}

Json gyro_answer(const Json& result) {
  const Json& gyro = result.at("gyro");
  if (gyro.is_null() || gyro.at("bias").is_null() || gyro.at("bias").at("end_rad_s").is_null())
    return nullptr;
  return {{"kind", "gyro_bias"},
          {"value", gyro.at("bias").at("end_rad_s")},
          {"sigma", gyro.at("bias").at("end_sigma_rad_s")},
          {"rest_s", gyro.at("bias").at("rest_s")}};
}

void add(Json answer, Json& answers) {
  if (!answer.is_null()) answers.push_back(std::move(answer));
}

void attend_calibration(const Json& calibration, Json& attention) {
  const Json ratio = wheel_ratio(calibration);
  for (const Json& wheels : {ratio, wheel_scale(calibration)})
    if (!wheels.is_null() && std::abs(number_or_zero(wheels.at("sigmas_from_nominal"))) > kFarSigmas)
      attention.push_back(wheels);
  for (const Json& parameter : calibration.at("parameters")) {
    const std::string name = parameter.at("name");
    const bool covered_by_ratio = !ratio.is_null() && name.ends_with(".diameter");
    if (covered_by_ratio || std::abs(number_or_zero(parameter.at("sigmas_from_nominal"))) <= kFarSigmas)
      continue;
    add(parameter_answer(calibration, name), attention);
  }
  for (const Json& sentence : calibration.at("cannot_tell"))
    attention.push_back({{"kind", "cannot_tell"}, {"words", sentence}});
  for (const Json& sentence : calibration.at("warnings"))
    attention.push_back({{"kind", "warning"}, {"words", sentence}});
}

/// Odometry before calibration, or before slips are corrected, is there to compare with.
bool is_superseded(const std::string& role, const Json& result) {
  return role == "nominal" || (role == "odometry" && error_of(result, {"corrected"}) != nullptr);
}

void attend_consistency(const Json& result, Json& attention) {
  for (const Json& error : result.at("errors")) {
    const Json& share = error.at("summary").at("share_inside_95");
    if (is_superseded(error.at("role"), result) || !share.is_number() || share.get<double>() >= kHonestShare)
      continue;
    attention.push_back({{"kind", "overconfident"},
                         {"role", error.at("role")},
                         {"name", error.at("name")},
                         {"reference_is_exact", error.at("summary").at("reference_noise").is_null()},
                         {"share_inside_95", share}});
  }
  const Json& sightings = result.at("sightings");
  if (sightings.is_null() || !sightings.at("nis_mean").is_number()) return;
  const double expected = sightings.at("nis_expected");
  if (sightings.at("nis_mean").get<double>() > kHonestNis * expected)
    attention.push_back({{"kind", "nis"}, {"mean", sightings.at("nis_mean")}, {"expected", expected}});
}

/// The calibration set the clock: there is nothing left to do.
bool is_settled(const HealthProblem& problem, const Results& results) {
  if (!results.calibration) return false;
  return (problem.is_of_gyro_clock && results.calibration->sets_gyro_clock) ||
         (problem.is_of_steering_clock && results.calibration->sets_steering_clock);
}

void attend_stages(const Results& results, Json& attention) {
  if (!results.run) return;
  for (const Stage& stage : results.run->stages)
    if (stage.kind != StageKind::report && stage.status == StageStatus::failed)
      attention.push_back({{"kind", "stage"}, {"name", name_of(stage)}, {"words", stage.message}});
}

void attend_health(const Results& results, Json& attention) {
  if (!results.info) return;
  for (const HealthProblem& problem : results.info->problems)
    if (problem.is_warning && !is_settled(problem, results))
      attention.push_back({{"kind", "problem"}, {"place", problem.place}, {"words", problem.message}});
}

}  // namespace

Json answers_json(const Json& result) {
  Json answers = Json::array();
  const Json& calibration = result.at("calibration");
  add(track_error(result), answers);
  if (calibration.is_object()) {
    if (answers.empty()) add(calibration_errors(calibration), answers);
    add(wheel_ratio(calibration), answers);
    add(other_parameter(calibration), answers);
  }
  add(slip_answer(result), answers);
  add(map_answer(result), answers);
  add(gyro_answer(result), answers);
  if (answers.size() > kMostAnswers) answers.erase(answers.begin() + kMostAnswers, answers.end());
  return answers;
}

Json attention_json(const Json& parts, const Results& results) {
  Json attention = Json::array();
  attend_stages(results, attention);
  if (results.calibration) attend_calibration(results.calibration->document, attention);
  const Json slip = slip_answer(parts);
  if (!slip.is_null() && slip.at("count") > 0) attention.push_back(slip);
  attend_consistency(parts, attention);
  attend_health(results, attention);
  return attention;
}

}  // namespace trundle::report
