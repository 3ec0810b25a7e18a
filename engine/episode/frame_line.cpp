#include "engine/episode/frame_line.h"

#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/exercise/score_file.h"
#include "engine/io/text.h"

namespace episode {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
    return std::isnan(value) ? Json(nullptr) : Json(value);
}

/// Adds a field's value under its name.
struct Add {
    Json& json;
    const std::string name;
    const exercise::Simulation& simulation;

    void operator()(std::int64_t value) const { json[name] = value; }
    void operator()(double value) const { json[name] = number(value); }
    void operator()(bool value) const { json[name] = value; }
    void operator()(const exercise::Place& place) const { json[name] = place; }
    void operator()(const exercise::InImage& place) const { json[name] = {place.x, place.y}; }
    void operator()(const exercise::OfDevices& value) const {
        json[name] = value.of[0];
        for (int k = 1; k < script::most_devices; ++k) {
            const auto role = static_cast<script::DeviceRole>(k);
            const std::optional<int> place = simulation.scenario().index_of(role);
            json[fmt::format("{}_{}", script::name_of(role), name)] = place ? value.of[*place] : 0;
        }
    }
    void operator()(exercise::Branch branch) const { json[name] = name_of(branch, simulation.anatomy()); }
    void operator()(script::DeviceRole held) const { json[name] = script::name_of(held); }
};

}  // namespace

std::string to_json(const Episode& episode) {
    const exercise::Simulation& simulation = episode.simulation();
    const Observation reading = episode.reading();
    const render::CArm arm = episode.arm(simulation.scenario().c_arm.pixels);
    Json json;
    for (const exercise::Field& field : exercise::fields()) {
        if (field.name.empty()) continue;
        const Add add{json, std::string(field.name), simulation};
        std::visit([&](const auto member) { add(reading.*member); }, field.member);
    }
    for (const ListField& field : list_fields()) {
        Json rows = Json::array();
        const std::vector<double> numbers = field.of(episode, arm);
        const auto columns = static_cast<std::size_t>(field.columns);
        for (std::size_t i = 0; i < numbers.size(); i += columns)
            rows.push_back(
                columns == 1 ? Json(numbers[i])
                             : Json(std::vector<double>(numbers.begin() + i, numbers.begin() + i + columns)));
        json[std::string(field.name)] = std::move(rows);
    }
    json["hash"] = io::hash_text(episode.hash());
    return json.dump();
}

std::string score_line(const Episode& episode, const std::string& program) {
    const exercise::Exercise& exercise = episode.exercise();
    return Json::parse(exercise::to_json({program,
                                          {},
                                          exercise.finish(),
                                          exercise.earlier_attempts(),
                                          exercise.simulation().scenario().lesson.benchmark}))
        .dump();
}

std::string quoted(const std::string& text) {
    return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace episode
