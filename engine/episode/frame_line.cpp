#include "engine/episode/frame_line.h"

#include <nlohmann/json.hpp>

#include "engine/exercise/score_file.h"
#include "engine/io/text.h"
#include "physics/geometry/vec.h"

namespace episode {
namespace {

using Json = nlohmann::ordered_json;

Json list(const geometry::Vec3& v) {
    return {v.x(), v.y(), v.z()};
}

Json in_image(const render::CArm& arm, const geometry::Vec3& place) {
    const render::Pixel pixel = render::project(arm, place);
    return {pixel.x, pixel.y};
}

void add_device(Json& json, const std::string& name, const geometry::Polyline& joints,
                const render::CArm& arm, const geometry::Vec3& shift) {
    Json places = Json::array(), pixels = Json::array();
    for (const geometry::Vec3& joint : joints) {
        places.push_back(list(joint + shift));
        pixels.push_back(in_image(arm, joint + shift));
    }
    json[name + "_mm"] = std::move(places);
    json[name + "_px"] = std::move(pixels);
}

void add_hand(Json& json, const std::string& name, const Hand& hand) {
    json[name + "inserted_mm"] = hand.inserted;
    json[name + "turned_deg"] = hand.turned / geometry::degree;
    json[name + "push_N"] = hand.push;
    json[name + "torque_Nmm"] = hand.torque;
}

}  // namespace

std::string to_json(const Episode& episode) {
    const exercise::Simulation& simulation = episode.simulation();
    const Reading r = episode.reading();
    const render::CArm arm = episode.arm(simulation.scenario().c_arm.pixels);
    Json json;
    json["frame"] = r.time.attempt;
    json["time_s"] = r.time.seconds;
    json["tip_mm"] = list(r.tip);
    json["tip_direction"] = list(r.direction);
    json["tip_px"] = in_image(arm, r.tip);
    json["target_mm"] = list(r.target);
    json["target_px"] = in_image(arm, r.target);
    json["branch"] = simulation.anatomy().branches[static_cast<std::size_t>(r.branch)].name;
    json["along_mm"] = r.along;
    json["path_to_target_mm"] = r.path_to_target ? Json(*r.path_to_target) : Json(nullptr);
    json["tip_to_target_mm"] = r.tip_to_target;
    add_hand(json, "", r.wire);
    add_hand(json, "catheter_", r.catheter);
    json["tip_force_N"] = r.tip_force;
    json["wall_force_N"] = r.wall_force;
    Json forces = Json::array();
    for (const auto& contact : simulation.contacts()) forces.push_back(contact.force());
    json["joint_force_N"] = std::move(forces);
    json["air_kerma_mGy"] = r.air_kerma;
    json["area_product_Gycm2"] = r.area_product;
    add_device(json, "wire", simulation.path_of(script::Held::Wire), arm, r.shift);
    add_device(json, "catheter",
               simulation.has_catheter() ? simulation.path_of(script::Held::Catheter) : geometry::Polyline(),
               arm, r.shift);
    json["settling"] = r.settling;
    json["at_rest"] = r.at_rest;
    json["certified"] = r.certified;
    json["refused"] = r.refused;
    json["buckled"] = r.buckled;
    json["too_thick"] = r.too_thick;
    json["insertion_stopped"] = r.insertion_stopped;
    json["withdrawal_stopped"] = r.withdrawal_stopped;
    json["whole_wire_is_in"] = r.whole_wire_is_in;
    json["on_target"] = r.on_target;
    json["completed"] = r.completed;
    json["time_is_up"] = r.time_is_up;
    json["hash"] = io::hash_text(episode.hash());
    return json.dump();
}

std::string score_line(const Episode& episode, const std::string& program) {
    const exercise::Exercise& exercise = episode.exercise();
    return Json::parse(exercise::to_json({program,
                                          {},
                                          exercise.finish(),
                                          exercise.earlier_attempts(),
                                          exercise.simulation().scenario().lesson.par}))
        .dump();
}

std::string quoted(const std::string& text) {
    return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace episode
