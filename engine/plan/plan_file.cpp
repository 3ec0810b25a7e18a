#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/plan/plan.h"

namespace plan {
namespace {

using Json = nlohmann::ordered_json;

constexpr int schema = 1;

Json number_or_null(const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
}

Json json_of(const Failure& one) {
    return {{"ends", ending_names[static_cast<std::size_t>(one.ending)]},
            {"device", script::name_of(one.device)},
            {"branch", one.branch},
            {"along_mm", one.along},
            {"left_mm", one.left},
            {"times", one.times}};
}

Json json_of(const Sensitivity& one) {
    return {{"of", one.of},
            {"change", one.change},
            {"unit", one.unit},
            {"tip_mm", one.tip},
            {"force_N", one.force},
            {"reach_of_2", one.reach},
            {"tip_at_end_mm", number_or_null(one.at_end)},
            {"force_at_end_N", number_or_null(one.force_at_end)}};
}

/// What both kinds of file say.
Json summary_of(const Planned& one) {
    Json json = {{"devices", one.name},
                 {"described", one.devices},
                 {"reached", one.reached},
                 {"within_limits", one.within_limits},
                 {"stopped", one.stopped},
                 {"refused", one.refused},
                 {"settings", one.settings},
                 {"left_mm", one.left},
                 {"success", one.success()},
                 {"hands", one.hands},
                 {"hands_reach", one.hands_reach},
                 {"played", one.played},
                 {"played_reach", one.played_reach},
                 {"peak_wall_force_N", one.peak_force},
                 {"mean_wall_force_N", one.mean_force},
                 {"wall_force_impulse_N_s", one.impulse},
                 {"turns", one.turns},
                 {"exchanges", one.exchanges},
                 {"travel_mm", one.travel},
                 {"time_s", one.seconds},
                 {"air_kerma_mGy", number_or_null(one.air_kerma)},
                 {"area_product_Gy_cm2", number_or_null(one.area_product)},
                 {"contrast_ml", one.contrast},
                 {"tip_error_mm", number_or_null(one.tip_error)},
                 {"wall_force_error_N", number_or_null(one.force_error)},
                 {"tip_error_wall_mm", number_or_null(one.model_errors.wall)},
                 {"tip_error_vessels_mm", number_or_null(one.model_errors.vessels)},
                 {"tip_error_twist_mm", number_or_null(one.model_errors.twist)},
                 {"wall_error_mm", number_or_null(one.model_errors.wall_off)},
                 {"left_out", one.left_out},
                 {"not_tried", one.not_tried},
                 {"handling_errors", one.handling_errors},
                 {"defects", one.defects},
                 {"frames_simulated", one.frames},
                 {"states_kept", one.states},
                 {"courses_found", one.courses},
                 {"course", one.course}};
    for (const Failure& failure : one.failures) json["failures"].push_back(json_of(failure));
    for (const Sensitivity& of : one.sensitivities) json["sensitivities"].push_back(json_of(of));
    return json;
}

}  // namespace

std::string to_json(const Planned& one) {
    Json json = {{"schema", schema}, {"identity", one.identity}};
    json.update(summary_of(one));
    json["scenario"] = one.scenario;
    Json moments = Json::array();
    for (const Moment& m : one.moments)
        moments.push_back({m.seconds, m.left, m.force, m.push, m.tip.x(), m.tip.y(), m.tip.z()});
    json["moments"] = moments;
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Planned planned_from(const std::string& text, const std::string& file) {
    io::check_json_depth(text, file);
    try {
        const Json json = Json::parse(text);
        if (json.at("schema").get<int>() != schema)
            throw io::InputError("{}: expected schema {}, found {}", file, schema,
                                 json.at("schema").get<int>());
        Planned one;
        const auto get = [&json](const char* key, auto& value) { json.at(key).get_to(value); };
        const auto maybe = [&json](const char* key, std::optional<double>& value) {
            if (!json.at(key).is_null()) value = json.at(key).get<double>();
        };
        get("identity", one.identity);
        get("devices", one.name);
        get("described", one.devices);
        get("scenario", one.scenario);
        get("reached", one.reached);
        get("within_limits", one.within_limits);
        get("stopped", one.stopped);
        get("refused", one.refused);
        get("settings", one.settings);
        get("left_mm", one.left);
        get("hands", one.hands);
        get("hands_reach", one.hands_reach);
        get("played", one.played);
        get("played_reach", one.played_reach);
        get("peak_wall_force_N", one.peak_force);
        get("mean_wall_force_N", one.mean_force);
        get("wall_force_impulse_N_s", one.impulse);
        get("turns", one.turns);
        get("exchanges", one.exchanges);
        get("travel_mm", one.travel);
        get("time_s", one.seconds);
        maybe("air_kerma_mGy", one.air_kerma);
        maybe("area_product_Gy_cm2", one.area_product);
        get("contrast_ml", one.contrast);
        maybe("tip_error_mm", one.tip_error);
        maybe("wall_force_error_N", one.force_error);
        maybe("tip_error_wall_mm", one.model_errors.wall);
        maybe("tip_error_vessels_mm", one.model_errors.vessels);
        maybe("tip_error_twist_mm", one.model_errors.twist);
        maybe("wall_error_mm", one.model_errors.wall_off);
        get("left_out", one.left_out);
        get("not_tried", one.not_tried);
        get("handling_errors", one.handling_errors);
        get("defects", one.defects);
        get("frames_simulated", one.frames);
        get("states_kept", one.states);
        get("courses_found", one.courses);
        get("course", one.course);
        for (const Json& failure : json.value("failures", Json::array())) {
            Failure made;
            const std::string ends = failure.at("ends");
            for (std::size_t k = 0; k < ending_names.size(); ++k)
                if (ending_names[k] == ends) made.ending = static_cast<Ending>(k);
            made.device = script::role_named(failure.at("device").get<std::string>())
                              .value_or(script::DeviceRole::Wire);
            failure.at("branch").get_to(made.branch);
            failure.at("along_mm").get_to(made.along);
            failure.at("left_mm").get_to(made.left);
            failure.at("times").get_to(made.times);
            one.failures.push_back(made);
        }
        for (const Json& of : json.value("sensitivities", Json::array())) {
            Sensitivity made{of.at("of"),     of.at("change"),  of.at("unit"),
                             of.at("tip_mm"), of.at("force_N"), of.at("reach_of_2")};
            if (!of.at("tip_at_end_mm").is_null()) made.at_end = of.at("tip_at_end_mm").get<double>();
            if (!of.at("force_at_end_N").is_null()) made.force_at_end = of.at("force_at_end_N").get<double>();
            one.sensitivities.push_back(made);
        }
        for (const Json& m : json.at("moments")) {
            const auto v = m.get<std::array<double, 7>>();
            one.moments.push_back({v[0], v[1], v[2], v[3], {v[4], v[5], v[6]}});
        }
        return one;
    } catch (const nlohmann::json::exception& error) {
        throw io::InputError("{}: expected a candidate's file as 'plan' writes it: {}", file, error.what());
    }
}

std::string plan_json(const std::vector<Planned>& all, const std::string& program) {
    Json json = {{"schema", schema}, {"program", program}, {"ranked", Json::array()}};
    for (const Planned& one : all) json["ranked"].push_back(summary_of(one));
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace plan
