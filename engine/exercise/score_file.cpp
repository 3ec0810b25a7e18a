#include "engine/exercise/score_file.h"

#include <nlohmann/json.hpp>

#include "engine/exercise/grade.h"
#include "engine/exercise/score.h"
#include "physics/geometry/vec.h"

namespace exercise {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
}

Json of_handling_error(const HandlingErrorMark& mark) {
    const auto kind = static_cast<std::size_t>(mark.kind);
    Json json = {{"error", handling_error_ids[kind]},
                 {"frame", mark.first},
                 {"last_frame", mark.last},
                 {"time_s", mark.start},
                 {"branch", mark.branch},
                 {"place_mm", {mark.place.x(), mark.place.y(), mark.place.z()}},
                 {"amount", mark.amount},
                 {"unit", handling_error_units[kind]}};
    if (mark.wall) {
        json["device"] = script::name_of(mark.wall->device);
        json["along_branch_mm"] = mark.wall->along;
        json["threshold_N"] = mark.wall->threshold;
        json["threshold_source"] = mark.wall->source;
    }
    return json;
}

Json of_handling(const Score& s) {
    const auto number = counts(s.handling_errors);
    Json by_kind, marks = Json::array();
    for (std::size_t kind = 0; kind < handling_error_kinds; ++kind)
        by_kind[handling_error_ids[kind]] = number[kind];
    for (const HandlingErrorMark& mark : s.handling_errors) marks.push_back(of_handling_error(mark));
    return {{"total", s.handling_errors.size()}, {"counts", by_kind}, {"marks", marks}};
}

Json of_event(const SetByTeacher& event) {
    const Complication& c = event.what;
    Json json = {{"kind", script::name_of(c.kind)}, {"text", event.text}};
    if (!event.branch.empty()) {
        json["branch"] = event.branch;
        json["at_mm"] = c.at;
        json["over_mm"] = c.over;
        json["percent"] = c.percent;
        json["held_off"] = c.held_off;
    }
    json["frame"] = c.since;
    json["time_s"] = event.set;
    json["relieved_frame"] = c.set() ? Json(nullptr) : Json(c.relieved);
    json["relieved_s"] = or_null(event.relieved);
    return json;
}

Json of_grade(const Score& s, const scenario::Benchmark& benchmark) {
    const Grade made = grade(s, benchmark);
    Json lines = Json::array();
    for (const GradeLine& line : made.lines)
        lines.push_back({{"id", line.measure->id},
                         {"name", line.measure->name},
                         {"unit", line.measure->unit},
                         {"yours", or_null(line.yours)},
                         {"mean", or_null(line.mean)},
                         {"spread", or_null(line.spread)},
                         {"without_looking", line.unseen},
                         {"most", line.measure->most},
                         {"cost", line.cost},
                         {"evidence", line.measure->evidence}});
    return {{"points", made.points},
            {"formula", grade_formula},
            {"lines", lines},
            {"cost_of_injuries", made.cost_of_injuries()}};
}

Json of_dose(const DosePart& part) {
    return {{"pulses", part.pulses},
            {"air_kerma_mGy", part.air_kerma},
            {"kerma_area_product_Gy_cm2", part.area_product}};
}

Json of_lesion_state(const LesionState& s) {
    return {{"lumen_mm", s.lumen},
            {"reference_mm", s.reference},
            {"residual_percent", s.residual},
            {"proximal_mmHg", or_null(s.proximal)},
            {"distal_mmHg", or_null(s.distal)},
            {"gradient_mmHg", or_null(s.gradient())},
            {"pd_pa", or_null(s.ratio)},
            {"pd_pa_hyperaemic", or_null(s.hyperaemic)}};
}

Json of_stented(const StentedLesion& s) {
    return {{"covered_percent", s.covered},
            {"missed_proximal_mm", s.missed_proximal},
            {"missed_distal_mm", s.missed_distal},
            {"proximal_end_mm", s.proximal_end},
            {"distal_end_mm", s.distal_end},
            {"proximal_off_plan_mm", or_null(s.proximal_off)},
            {"distal_off_plan_mm", or_null(s.distal_off)},
            {"protrusion_mm", or_null(s.protrusion)},
            {"balloon_beyond_proximal_mm", or_null(s.beyond_proximal)},
            {"balloon_beyond_distal_mm", or_null(s.beyond_distal)},
            {"largest_gap_mm", or_null(s.gap)},
            {"apposed_percent", or_null(s.apposed)},
            {"expansion_percent", or_null(s.expansion)},
            {"jailed_branches", s.jailed}};
}

Json of_treatment(const TreatmentScore& s) {
    Json lesions = Json::array(), stents = Json::array();
    for (const LesionScore& lesion : s.lesions)
        lesions.push_back({{"branch", lesion.branch},
                           {"at_mm", lesion.at},
                           {"length_mm", lesion.length},
                           {"before", of_lesion_state(lesion.before)},
                           {"after", of_lesion_state(lesion.after)},
                           {"stented", lesion.stented ? of_stented(*lesion.stented) : Json(nullptr)}});
    for (const StentScore& stent : s.stents)
        stents.push_back({{"device", stent.device},
                          {"frame", stent.frame},
                          {"length_mm", stent.length},
                          {"diameter_mm", stent.diameter},
                          {"lesion", stent.lesion < 0 ? Json(nullptr) : Json(stent.lesion)},
                          {"attached", stent.attached}});
    const InflationTally& t = s.tally;
    return {{"lesions", lesions},
            {"stents", stents},
            {"inflations", t.inflations},
            {"highest_pressure_atm", t.highest},
            {"inflated_s", t.seconds},
            {"beyond_rated_s", t.beyond_rated},
            {"occluded_s", t.occluded},
            {"longest_occlusion_s", t.longest},
            {"balloon_to_artery", t.largest_ratio > 0 ? Json(t.largest_ratio) : Json(nullptr)},
            {"bursts", s.bursts},
            {"dissections", s.dissections},
            {"dissections_left", s.dissections_left},
            {"ruptures", s.ruptures}};
}

void add_attempt(Json& json, const Score& s) {
    json["completed"] = s.completed;
    json["completed_after_s"] = or_null(s.completed_after);
    json["completion_time_s"] = or_null(s.completion_time);
    json["duration_s"] = s.duration;
    json["beam_on_time_s"] = s.beam_on_time;
    json["pulses"] = s.pulses;
    json["dsa_runs"] = s.runs;
    json["cine_runs"] = s.cine_runs;
    json["views"] = s.views;
    json["air_kerma_mGy"] = or_null(s.air_kerma);
    json["kerma_area_product_Gy_cm2"] = or_null(s.area_product);
    if (s.dose)
        for (const script::ImagingMode mode : {script::ImagingMode::Live, script::ImagingMode::Roadmap,
                                               script::ImagingMode::Dsa, script::ImagingMode::Cine})
            json["dose_by_mode"][std::string(script::name_of(mode))] =
                of_dose(s.dose->by_mode[static_cast<std::size_t>(mode)]);
    json["contrast_ml"] = s.contrast;
    json["angiograms"] = s.angiograms;
    json["wire_travel_mm"] = s.wire_travel;
    json["advanced_mm"] = s.advanced;
    json["withdrawn_mm"] = s.withdrawn;
    json["back_and_forth_ratio"] = s.back_and_forth_ratio;
    json["reversals"] = s.reversals;
    json["rotation_deg"] = s.rotation / geometry::degree;
    json["idle_share"] = s.idle_fraction;
    json["tip_path_mm"] = s.tip_path;
    json["path_efficiency"] = s.path_efficiency;
    json["mean_tip_speed_mm_per_s"] = s.mean_tip_speed;
    json["spectral_arc_length"] = or_null(s.spectral_arc_length);
    json["log_dimensionless_jerk"] = or_null(s.log_dimensionless_jerk);
    json["peak_wall_force_N"] = s.peak_wall_force;
    json["mean_wall_force_N"] = s.mean_wall_force;
    json["force_threshold_N"] = HandlingErrorLimits().force;
    json["time_over_force_threshold_s"] = s.time_over_force;
    json["wall_force_impulse_N_s"] = s.wall_force_impulse;
    json["max_penetration_mm"] = s.deepest.penetration;
    if (s.deepest.joint >= 0) {
        json["max_penetration_at"] = {{"joint", s.deepest.joint},
                                      {"frame", s.deepest.frame},
                                      {"stiffness_N_per_mm", s.deepest.stiffness},
                                      {"force_N", s.deepest.force}};
    }
    json["buckled_frames"] = s.buckled_frames;
    json["tip_to_target_mm"] = s.tip_to_target;
    Json wrong = Json::array();
    for (const WrongBranch& branch : s.wrong_branches)
        wrong.push_back({{"branch", branch.name}, {"entries", branch.entries}, {"time_s", branch.seconds}});
    json["wrong_branches"] = wrong;
    json["handling_errors"] = of_handling(s);
    for (const SetByTeacher& event : s.set_by_teacher) json["set_by_teacher"].push_back(of_event(event));
    if (s.treatment) json["treatment"] = of_treatment(*s.treatment);
    if (s.teacher.empty()) return;
    Json acts = Json::array();
    for (const TeacherMark& mark : s.teacher)
        acts.push_back(
            {{"act", id_of(mark.act)}, {"on", mark.act.on}, {"frame", mark.frame}, {"time_s", mark.seconds}});
    json["teacher"] = acts;
}

Json of_benchmark(const scenario::Benchmark& benchmark) {
    Json json = {{"by", benchmark.by}, {"attempts", benchmark.attempts}};
    for (const scenario::BenchmarkFigure& figure : scenario::benchmark_figures())
        if (const scenario::Sample& sample = benchmark.*figure.sample; sample.given())
            json[std::string(figure.key)] = sample.values;
    return json;
}

}  // namespace

std::string to_json(const ScoreReport& report) {
    Json json;
    json["schema"] = 3;
    json["program"] = report.program;
    if (!report.learner.empty()) json["learner"] = report.learner;
    json["scenario"] = report.score.scenario;
    add_attempt(json, report.score);
    const bool graded = report.benchmark.given();
    json["benchmark"] = graded ? of_benchmark(report.benchmark) : Json(nullptr);
    json["grade"] = graded ? of_grade(report.score, report.benchmark) : Json(nullptr);
    json["resets"] = report.score.resets;
    json["frames"] = report.score.frames;
    json["interrupted"] = report.score.interrupted;
    Json earlier = Json::array();
    for (const Score& score : report.earlier) {
        Json attempt;
        add_attempt(attempt, score);
        earlier.push_back(attempt);
    }
    json["earlier_attempts"] = earlier;
    // A learner's name is whatever was typed.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace exercise
