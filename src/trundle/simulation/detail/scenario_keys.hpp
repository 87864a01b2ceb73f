#pragma once

#include "trundle/chassis/detail/toml_source.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/simulation/sheet.hpp"

// The numbers of a scenario file, one table for each of its sections; docs/simulation.md explains them.
namespace trundle::simulation::scenario_file {

using namespace robot_file;

inline constexpr Range kShare{[](double v) { return v >= 0.0 && v <= 1.0; }, "a number between 0 and 1"};
inline constexpr Range kRate{[](double v) { return v >= 0.0 && v <= 1e5; }, "a rate between 0 and 100000 Hz"};
inline constexpr Range kPositiveRate{[](double v) { return v > 0.0 && v <= 1e5; },
                                     "a rate above 0 and at most 100000 Hz"};
inline constexpr Range kDuration{[](double v) { return v > 0.0 && v <= 1e6; },
                                 "seconds above 0, at most 1000000"};

/// What may differ between the true and the nominal wheel.
inline constexpr std::array kTrueWheel{
    NumberKey<Wheel>{"x_m", [](Wheel& w) -> double& { return w.x_m; }, kPosition},
    NumberKey<Wheel>{"y_m", [](Wheel& w) -> double& { return w.y_m; }, kPosition},
    NumberKey<Wheel>{"direction_deg", [](Wheel& w) -> double& { return w.direction_rad; }, kAngle},
    NumberKey<Wheel>{"roller_deg", [](Wheel& w) -> double& { return w.roller_rad; }, kRoller},
    NumberKey<Wheel>{"diameter_m", [](Wheel& w) -> double& { return w.diameter_m; }, kDiameter},
    NumberKey<Wheel>{"ticks_per_revolution", [](Wheel& w) -> double& { return w.ticks_per_revolution; }},
};

inline constexpr std::array kPace{
    NumberKey<Pace>{"forward_m_s", [](Pace& p) -> double& { return p.forward_m_s; }, kPositive},
    NumberKey<Pace>{"turn_rad_s", [](Pace& p) -> double& { return p.turn_rad_s; }, kPositive},
    NumberKey<Pace>{"rest_s", [](Pace& p) -> double& { return p.rest_s; }, kNotNegative},
};

inline constexpr std::array kStart{
    NumberKey<Scenario>{"x_m", [](Scenario& s) -> double& { return s.start.x; }},
    NumberKey<Scenario>{"y_m", [](Scenario& s) -> double& { return s.start.y; }},
    NumberKey<Scenario>{"heading_deg", [](Scenario& s) -> double& { return s.start.heading; }, kAngle},
    NumberKey<Scenario>{"time_s", [](Scenario& s) -> double& { return s.start_s; }},
};

inline constexpr std::array kEncoders{
    NumberKey<EncoderOptions>{"rate_hz", [](EncoderOptions& e) -> double& { return e.rate_hz; },
                              kPositiveRate},
};

inline constexpr std::array kSteered{
    NumberKey<SteeredOptions>{"ramp_s", [](SteeredOptions& s) -> double& { return s.ramp_s; }, kNotNegative},
};

inline constexpr std::array kGyroReadings{
    NumberKey<GyroOptions>{"rate_hz", [](GyroOptions& g) -> double& { return g.rate_hz; }, kPositiveRate},
};

inline constexpr std::array kSightings{
    NumberKey<SightingOptions>{"rate_hz", [](SightingOptions& s) -> double& { return s.rate_hz; }, kRate},
    NumberKey<SightingOptions>{"field_of_view_deg",
                               [](SightingOptions& s) -> double& { return s.field_of_view_rad; }, kAngle},
    NumberKey<SightingOptions>{"detection", [](SightingOptions& s) -> double& { return s.detection; },
                               kShare},
};

inline constexpr std::array kReference{
    NumberKey<ReferenceOptions>{"rate_hz", [](ReferenceOptions& r) -> double& { return r.rate_hz; }, kRate},
    NumberKey<ReferenceOptions>{
        "position_sigma_m", [](ReferenceOptions& r) -> double& { return r.position_sigma_m; }, kNotNegative},
    NumberKey<ReferenceOptions>{"heading_sigma_deg",
                                [](ReferenceOptions& r) -> double& { return r.heading_sigma_rad; },
                                kNotNegative},
    NumberKey<ReferenceOptions>{
        "wander_sigma_m", [](ReferenceOptions& r) -> double& { return r.wander_sigma_m; }, kNotNegative},
    NumberKey<ReferenceOptions>{"wander_time_s",
                                [](ReferenceOptions& r) -> double& { return r.wander_time_s; }, kPositive},
    NumberKey<ReferenceOptions>{"outlier_share",
                                [](ReferenceOptions& r) -> double& { return r.outlier_share; }, kShare},
    NumberKey<ReferenceOptions>{"outlier_m", [](ReferenceOptions& r) -> double& { return r.outlier_m; },
                                kNotNegative},
};

inline constexpr std::array kPartial{
    NumberKey<PartialReferenceOptions>{
        "position_sigma_m", [](PartialReferenceOptions& p) -> double& { return p.position_sigma_m; },
        kPositive},
    NumberKey<PartialReferenceOptions>{
        "heading_sigma_deg", [](PartialReferenceOptions& p) -> double& { return p.heading_sigma_rad; },
        kPositive},
};

inline constexpr std::array kSpan{
    NumberKey<TimeSpan>{"start_s", [](TimeSpan& s) -> double& { return s.start_s; }, kNotNegative,
                        Presence::required},
    NumberKey<TimeSpan>{"duration_s", [](TimeSpan& s) -> double& { return s.duration_s; }, kDuration,
                        Presence::required},
};

inline constexpr std::array kSlip{
    NumberKey<SlipBurst>{"factor", [](SlipBurst& s) -> double& { return s.factor; }, kNotNegative},
    NumberKey<SlipBurst>{"excess_m_s", [](SlipBurst& s) -> double& { return s.excess_m_s; }},
};

inline constexpr std::array kRandomSlips{
    NumberKey<RandomSlips>{"shortest_s", [](RandomSlips& s) -> double& { return s.shortest_s; }, kPositive},
    NumberKey<RandomSlips>{"longest_s", [](RandomSlips& s) -> double& { return s.longest_s; }, kPositive},
    NumberKey<RandomSlips>{"least_factor", [](RandomSlips& s) -> double& { return s.least_factor; },
                           kPositive},
    NumberKey<RandomSlips>{"greatest_factor", [](RandomSlips& s) -> double& { return s.greatest_factor; },
                           kPositive},
};

inline constexpr std::array kSheet{
    NumberKey<SheetPlan>{"side_m", [](SheetPlan& s) -> double& { return s.side_m; }, kPositive},
    NumberKey<SheetPlan>{"position_sigma_m", [](SheetPlan& s) -> double& { return s.position_sigma_m; },
                         kNotNegative},
    NumberKey<SheetPlan>{"heading_sigma_deg", [](SheetPlan& s) -> double& { return s.heading_sigma_rad; },
                         kNotNegative},
    NumberKey<SheetPlan>{"leg_sigma_m", [](SheetPlan& s) -> double& { return s.leg_sigma_m; }, kNotNegative},
};

template <class... Keys>
std::vector<std::string> names_with(std::vector<std::string> names, const Keys&... keys) {
  (add_names(keys, names), ...);
  return names;
}

/// Sets `target` when the key is there.
void read_flag(const Section& section, std::string_view key, bool& target);
void read_whole(const Section& section, std::string_view key, int lowest, int highest, int& target);
/// The index of the word among `words`.
std::size_t read_word(const Section& section, std::string_view key, std::span<const std::string> words);

}  // namespace trundle::simulation::scenario_file
