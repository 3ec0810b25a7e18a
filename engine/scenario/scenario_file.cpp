#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <toml++/toml.h>

#include "engine/anatomy/grow/vessel_file.h"
#include "engine/blood/contrast_flow.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"
#include "engine/scenario/device.h"
#include "engine/scenario/lesson_file.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "render/xray/materials.h"

namespace scenario {
namespace {

using geometry::Vec3;

constexpr std::size_t most_wall_terms = 64;

constexpr io::Range positive(double most) {
    return {1e-6, most};
}

void read_tube(io::Section tube, io::ParseContext& reading, Scenario& s) {
    if (!tube.given()) return;
    s.tube.emplace();
    std::vector<std::string_view> names;
    for (const anatomy::Scene& scene : anatomy::scenes()) names.push_back(scene.name);
    if (const auto scene = tube.choice("scene", names)) {
        s.tube->scene = names[*scene];
        s.tube->radius = anatomy::scenes()[*scene].radius;
    }
    if (const toml::node* path = tube.find("path")) {
        const toml::array* moves = path->as_array();
        if (!moves || moves->empty())
            tube.refuse("path", *path, "expected a list of moves {run_mm = …} or {arc_radius_mm = …}");
        for (std::size_t i = 0; moves && i < moves->size(); ++i) {
            const toml::table* table = (*moves)[i].as_table();
            if (!table) {
                tube.refuse("path", (*moves)[i], "expected a move {run_mm = …} or {arc_radius_mm = …}");
                continue;
            }
            io::Section move(reading, table, fmt::format("tube.path {}", i + 1));
            if (table->contains("run_mm")) {
                anatomy::Run run{1};
                move.number("run_mm", run.length, {0.1, 2000});
                s.tube->path.push_back(run);
            } else {
                anatomy::Arc arc{10, 0, Vec3::UnitZ()};
                move.number("arc_radius_mm", arc.radius, {0.5, 2000});
                move.number("angle_deg", arc.angle, {-720, 720}, geometry::degree);
                move.point("axis", arc.axis, 1e3);
                if (arc.axis.norm() < 1e-6)
                    move.refuse("axis", *table->get("axis"), "expected an axis other than zero");
                if (!table->contains("angle_deg")) move.missing("angle_deg", "angle_deg of the arc");
                s.tube->path.push_back(arc);
            }
            move.finish();
        }
    }
    tube.number("radius_mm", s.tube->radius, {0.2, 50});
    tube.whole("around", s.tube->around, {6, 512});
    tube.number("step_mm", s.tube->step, {0.05, 10});
    tube.finish();
}

constexpr const char* usual_wire = "glide035";

/// Says what a key of an earlier version is now.
void refuse_old_keys(io::Section& section) {
    std::string preset;
    if (const toml::node* node = section.find("preset"); node && section.word("preset", preset))
        section.refuse(
            "preset", *node,
            fmt::format("expected device = \"{0}\", found preset = \"{0}\": write frictionless = "
                        "true beside it, and torsion = \"rigid\" in [chain], for what a preset was",
                        preset));
    for (const char* key : {"segment_length_mm", "adaptive", "curve_tolerance_mm", "torsion"})
        if (const toml::node* node = section.find(key))
            section.refuse(key, *node, fmt::format("expected {} in [chain], as it is of all devices", key));
}

/// What a balloon can be changed to in the room.
void read_tray(io::Section& section, const std::filesystem::path& file, Scenario& s, PlacedDevice& placed) {
    const toml::node* node = section.find("tray");
    if (!node) return;
    constexpr const char* accepted =
        "expected a list of balloons and stents: [\"pta6x20\", \"stent6x18renal\"]";
    const toml::array* array = node->as_array();
    if (!array || array->empty()) return section.refuse("tray", *node, accepted);
    for (const toml::node& item : *array) {
        const std::optional<std::string> name = item.value_exact<std::string>();
        if (!name || name->empty()) {
            section.refuse("tray", item, accepted);
            continue;
        }
        try {
            const std::span<const DeviceKind> kinds = kinds_of(placed.role);
            const std::filesystem::path of = name->ends_with(".toml")
                                                 ? file.parent_path() / *name
                                                 : find_device(*name, s.catalogue, kinds);
            const Device device = load_device(of);
            if (std::ranges::count(kinds, device.kind) == 0)
                section.refuse("tray", item,
                               fmt::format("expected a {}, found '{}', a {}", names_of(kinds), *name,
                                           name_of(device.kind)));
            if (std::ranges::find(s.files, of) == s.files.end()) s.files.push_back(of);
            placed.tray.push_back(*name);
        } catch (const io::InputError& error) {
            section.refuse("tray", item, error.what());
        }
    }
}

/// A device of the catalogue, or of a file beside the scenario's, with the section's values.
void read_device(io::Section& section, script::DeviceRole role, const std::string& name,
                 const std::filesystem::path& file, Scenario& s) {
    PlacedDevice placed;
    placed.role = role;
    placed.section = name;
    Device& device = placed.device;
    const std::span<const DeviceKind> kinds = kinds_of(role);
    const toml::node* node = section.find("device");
    std::string wanted = role == script::DeviceRole::Wire ? usual_wire : "";
    if (!node && wanted.empty())
        section.missing("device", fmt::format("device = \"NAME\" of a {} of the catalogue, or its file,",
                                              names_of(kinds)));
    if (node) section.word("device", wanted);
    if (!wanted.empty()) {
        try {
            s.files.push_back(wanted.ends_with(".toml") ? file.parent_path() / wanted
                                                        : find_device(wanted, s.catalogue, kinds));
            device = load_device(s.files.back());
            if (std::ranges::count(kinds, device.kind) == 0 && node)
                section.refuse("device", *node,
                               fmt::format("expected a {}, found '{}', a {}", names_of(kinds), wanted,
                                           name_of(device.kind)));
        } catch (const io::InputError& error) {
            if (node)
                section.refuse("device", *node, error.what());
            else
                section.refuse_whole(error.what());
        }
    }
    if (std::ranges::count(kinds, device.kind) == 0) device.kind = kinds.front();
    section.number("inserted_mm", placed.inserted, {0, 2000});
    section.number("roll_deg", placed.roll, {-360, 360}, geometry::degree);
    section.flag("pinned", placed.pinned);
    if (role == script::DeviceRole::Balloon) read_tray(section, file, s, placed);
    override_device(section, device);
    refuse_old_keys(section);
    section.finish();
    s.devices.push_back(std::move(placed));
}

/// All devices, innermost first, which is the order of their roles.
void read_devices(io::Section& top, const std::filesystem::path& file, Scenario& s) {
    for (int k = 0; k < script::most_devices; ++k) {
        const auto role = static_cast<script::DeviceRole>(k);
        const std::string_view name = role == script::DeviceRole::Wire ? "guidewire" : script::name_of(role);
        if (io::Section section = top.section(name, false); section.given())
            read_device(section, role, std::string(name), file, s);
    }
    int number = 0;
    for (io::Section& section : top.sections("device")) {
        const std::string name = fmt::format("device {}", ++number);
        if (!section.find("name"))
            section.missing("name", "name = " + io::joined(script::device_names(), ", "));
        const auto role = section.choice("name", script::device_names());
        if (!role) continue;
        if (s.index_of(static_cast<script::DeviceRole>(*role))) {
            section.refuse(
                "name", *section.find("name"),
                fmt::format("expected each device once, found a second {}", script::device_names()[*role]));
            continue;
        }
        read_device(section, static_cast<script::DeviceRole>(*role), name, file, s);
    }
    if (!s.index_of(script::DeviceRole::Wire)) {
        io::Section none = top.section("guidewire", false);
        read_device(none, script::DeviceRole::Wire, "guidewire", file, s);
    }
    std::ranges::sort(s.devices, {}, &PlacedDevice::role);
    s.segment_length = usual_segment_length(s.wire().device);
}

void read_entry(io::Section entry, Scenario& s) {
    if (!entry.word("end", s.entry.end) && entry.given())
        entry.missing("end", "end = \"NAME of an open end\"");
    double& inserted = s.wire().inserted;
    const toml::node* node = entry.find("inserted_mm");
    if (inserted > 0 && node)
        entry.refuse("inserted_mm", *node,
                     "expected inserted_mm of the wire here or in the wire's own section, found both");
    if (inserted == 0) inserted = 60;
    entry.number("inserted_mm", inserted, {1, 2000});
    entry.number("sheath_F", s.entry.sheath, {1, 30}, french);
    entry.number("sheath_length_mm", s.entry.sheath_length, {10, 1000});
    entry.word("flush_catheter", s.entry.flush_catheter);
    entry.number("hand_mm", s.hand_distance, {script::least_grip, script::largest_grip});
    entry.finish();
}

/// What is of all devices together.
void read_chain(io::Section chain, Scenario& s) {
    if (chain.is_word("segment_length_mm")) {
        constexpr std::string_view words[] = {"auto"};
        s.choose_segment_length = chain.choice("segment_length_mm", words).has_value();
    } else {
        chain.number("segment_length_mm", s.segment_length, {0.1, 10});
    }
    chain.flag("adaptive", s.adaptive);
    chain.number("curve_tolerance_mm", s.refinement.curve_tolerance, {0.001, 5});
    chain.number("tip_error_mm", s.tip_error, {0.001, 5});
    constexpr std::string_view torsions[] = {"auto", "rigid", "compliant", "segments"};
    if (const auto torsion = chain.choice("torsion", torsions))
        s.torsion = static_cast<TorsionModel>(*torsion);
    chain.finish();
}

/// A row of [wall.variation] terms: k_g over k, and φ_g in degrees.
std::optional<physics::WallStiffness::Term> read_term(const toml::node& row) {
    const toml::array* pair = row.as_array();
    if (!pair || pair->size() != 2 || !(*pair)[0].is_number() || !(*pair)[1].is_number()) return std::nullopt;
    const double fraction = *(*pair)[0].value<double>(), phase = *(*pair)[1].value<double>();
    if (!(std::abs(fraction) < 1) || !(std::abs(phase) <= 360)) return std::nullopt;
    return physics::WallStiffness::Term{fraction, phase * geometry::degree};
}

/// Below the least modulus the weight of a catheter moves a vessel out of its place.
constexpr io::Range modulus_range = {0.005, 1e3}, vessel_wall_range = {0, 1e3};

void read_values(io::Section& section, TissueChoice::Values& values) {
    section.number("modulus_N_per_mm2", values.modulus, modulus_range);
    section.number("wall_N_per_mm2", values.wall, vessel_wall_range);
}

void read_tissue(io::Section section, TissueChoice& tissue) {
    if (!section.given()) return;
    tissue.rigid = false;
    section.flag("rigid", *tissue.rigid);
    read_values(section, tissue.all);
    for (io::Section& vessel : section.sections("vessel")) {
        TissueChoice::Values values;
        if (!vessel.word("name", values.vessel)) vessel.missing("name", "name = \"BRANCH\"");
        read_values(vessel, values);
        vessel.finish();
        tissue.vessels.push_back(std::move(values));
    }
    section.finish();
}

void read_injury(io::Section section, InjurySpec& injury) {
    if (!section.given()) return;
    constexpr io::Range strengths = {1e-3, 1e3}, forces = {1e-3, 1e3};
    section.flag("off", injury.off);
    section.number("perforation_N_per_mm2", injury.perforation, strengths);
    section.number("dissection_N_per_mm2", injury.dissection, strengths);
    section.number("wall_over_radius", injury.wall_over_radius, {0.01, 1});
    section.number("perforation_N", injury.perforation_force, forces);
    section.number("dissection_N", injury.dissection_force, forces);
    section.finish();
}

void read_variation(io::Section section, Scenario& s) {
    if (!section.given()) return;
    physics::WallVariation variation;
    const toml::node *seed = section.find("seed"), *terms = section.find("terms");
    std::uint64_t number = 0;
    section.whole("seed", number, {0, 9e15});
    section.number("length_mm", variation.length, {1, 1e5});
    if (!seed && !terms)
        section.missing("seed", "seed = NUMBER or terms = [[AMPLITUDE_SHARE, PHASE_DEG], ...]");
    else if (seed && terms)
        section.refuse("terms", *terms, "expected either 'seed' or 'terms'");
    if (seed) {
        const double length = variation.length;
        variation = physics::drawn_variation(number);
        variation.length = length;
    } else if (terms) {
        const toml::array* rows = terms->as_array();
        if (!rows || rows->empty() || rows->size() > most_wall_terms)
            section.refuse(
                "terms", *terms,
                fmt::format("expected 1 to {} pairs [amplitude share, phase in degrees]", most_wall_terms));
        else
            for (const toml::node& row : *rows) {
                const auto term = read_term(row);
                if (term)
                    variation.terms.push_back(*term);
                else
                    section.refuse("terms", row,
                                   "expected a pair [amplitude share, phase in degrees], the share above -1 "
                                   "and below 1, the phase from -360 to 360");
            }
        if (const double sum = variation.sum(); sum >= 1)
            section.refuse("terms", *terms,
                           fmt::format("the shares add up to {:.4g}, so that the stiffness could reach 0; "
                                       "expected shares that add up to less than 1",
                                       sum));
    }
    section.finish();
    s.wall_variation = std::move(variation);
}

void read_relaxer(io::Section relaxer, Scenario& s) {
    using enum physics::RelaxerKind;
    constexpr std::string_view names[] = {"global",    "segment",  "first-order",
                                          "geometric", "combined", "konings"};
    constexpr physics::RelaxerKind kinds[] = {Global, Segment, FirstOrder, Geometric, Combined, Konings};
    if (const auto kind = relaxer.choice("kind", names)) s.relaxer.kind = kinds[*kind];
    relaxer.whole("varied_segments", s.relaxer.varied_segments, {1, 5});
    relaxer.whole("separation", s.relaxer.separation, {2, 200});
    relaxer.whole("updates_per_frame", s.budget.updates, {1, 10'000'000});
    relaxer.number("distal_share", s.budget.distal_fraction, {0, 1});
    relaxer.whole("distal_segments", s.budget.distal_segments, {1, 100'000});
    constexpr std::string_view cycles[] = {"nested", "uniform"};
    if (const auto cycle = relaxer.choice("cycle", cycles)) {
        s.relaxer.order = *cycle == 0 ? physics::CycleOrder::Nested : physics::CycleOrder::Uniform;
    }
    relaxer.flag("safeguard", s.relaxer.safeguard);
    relaxer.flag("stored_planes", s.relaxer.stored_planes);
    relaxer.finish();
}

void read_lesions(io::Section& top, Scenario& s) {
    for (io::Section& section : top.sections("lesion")) {
        LesionSpec lesion;
        if (!section.word("branch", lesion.branch)) section.missing("branch", "branch = \"BRANCH\"");
        for (const char* key : {"at_mm", "length_mm", "percent"})
            if (!section.find(key)) section.missing(key, std::string(key) + " = ...");
        section.number("at_mm", lesion.at, {0, script::largest_place});
        section.number("length_mm", lesion.length,
                       {script::shortest_complication, script::longest_complication});
        section.number("percent", lesion.percent, {script::least_narrowing, script::largest_narrowing});
        section.number("eccentricity", lesion.eccentricity, {0, 1});
        section.number("angle_deg", lesion.angle, {-360, 360}, geometry::degree);
        if (const auto plaque = section.choice("plaque", physics::plaque_names))
            lesion.plaque = static_cast<physics::Plaque>(*plaque);
        const toml::node *from = section.find("stent_from_mm"), *to = section.find("stent_to_mm");
        if (!from != !to)
            section.refuse(from ? "stent_from_mm" : "stent_to_mm", from ? *from : *to,
                           "expected both stent_from_mm and stent_to_mm, or neither");
        if (from && to) {
            std::pair<double, double> ends;
            section.number("stent_from_mm", ends.first, {-50, script::largest_place});
            section.number("stent_to_mm", ends.second, {-50, script::largest_place});
            if (ends.second <= ends.first)
                section.refuse("stent_to_mm", *to,
                               fmt::format("expected a place beyond stent_from_mm, {:g}, found {:g}",
                                           ends.first, ends.second));
            lesion.stent = ends;
        }
        section.finish();
        s.lesions.push_back(std::move(lesion));
    }
}

void read_c_arm(io::Section arm, Scenario& s) {
    using Limits = render::ArmLimits;
    const auto number = [&arm](std::string_view key, double& value, Limits::Range range, double unit = 1.0) {
        arm.number(key, value, {range.least, range.most}, unit);
    };
    number("lao_deg", s.c_arm.lao, Limits::lao, geometry::degree);
    number("cranial_deg", s.c_arm.cranial, Limits::cranial, geometry::degree);
    number("sid_mm", s.c_arm.sid, Limits::sid);
    number("sod_mm", s.c_arm.sod, Limits::sod);
    arm.point("isocentre_mm", s.c_arm.isocentre, Limits::isocentre);
    number("detector_width_mm", s.c_arm.detector_width, Limits::detector_width);
    arm.whole("pixels", s.c_arm.pixels, {32, 2048});
    arm.finish();
}

/// Reads the file of an anatomy, or how to grow one.
void read_anatomy(io::Section& top, io::ParseContext& reading, Scenario& s) {
    const toml::node* node = top.find("anatomy");
    if (!node) return;
    if (node->is_table()) {
        io::Section vessels = top.section("anatomy", false);
        s.vessels = anatomy::read_vessels(vessels, reading, s.name);
    } else if (std::string file; node->is_string() && top.word("anatomy", file)) {
        s.anatomy = std::filesystem::path(reading.file).parent_path() / file;
    } else {
        top.refuse("anatomy", *node, "expected a file NAME.anatomy.json or a section [anatomy]");
    }
}

void read_imaging(io::Section imaging, Scenario& s) {
    imaging.number("detector_dose_nGy", s.imaging.detector_dose, {0.1, 1e5});
    imaging.number("acquisition_dose_nGy", s.imaging.acquisition_dose, {0.1, 1e5});
    imaging.number("cine_dose_nGy", s.imaging.cine_dose, {0.1, 1e5});
    if (std::string word; imaging.word("acquisition", word)) {
        if (word == "cine")
            s.imaging.acquisition = script::ImagingMode::Cine;
        else if (word != "dsa")
            imaging.refuse("acquisition", *imaging.find("acquisition"), R"(expected "dsa" or "cine")");
    }
    imaging.number("tube_voltage_kV", s.imaging.kvp, {40, 125});
    if (const toml::node* node = imaging.find("pulse_rate_hz")) {
        const auto rate = node->value<double>();
        if (rate && script::is_pulse_rate(*rate))
            s.imaging.pulse_rate = *rate;
        else
            imaging.refuse("pulse_rate_hz", *node, "expected " + script::pulse_rates_text());
    }
    imaging.number("iodine_mg_per_ml", s.imaging.iodine, {0, render::largest_iodine});
    imaging.flag("patient", s.imaging.patient);
    imaging.flag("table", s.imaging.table);
    imaging.flag("leads", s.imaging.leads);
    imaging.finish();
}

/// Materials that a segmented mesh may be of.
constexpr render::Material mesh_materials[] = {
    render::Material::CorticalBone, render::Material::TrabecularBone, render::Material::SoftTissue,
    render::Material::Adipose,      render::Material::Blood,          render::Material::Lung,
    render::Material::Air,          render::Material::Nitinol,        render::Material::Steel,
    render::Material::Platinum,     render::Material::Aluminium};

void read_patient(io::Section section, const std::filesystem::path& file, Scenario& s) {
    if (!section.given()) return;
    patient::PatientFiles& files = s.patient_files;
    const std::filesystem::path folder = file.parent_path();
    std::string name;
    const toml::node* ct = section.find("ct");
    if (section.word("ct", name)) files.ct = folder / name;
    const toml::node* series = section.find("series");
    if (section.word("series", files.series) && !ct)
        section.refuse("series", *series, "expected it only with ct = \"FOLDER of DICOM files\"");
    section.flag("keep_table", files.keep_table);
    section.flag("keep_contrast", files.keep_contrast);
    section.flag("partial", files.partial);
    section.point("shift_mm", files.shift, 1e4);
    if (section.point("rotation_deg", files.rotation, 360)) files.rotation *= geometry::degree;
    std::vector<std::string_view> names;
    for (const render::Material material : mesh_materials) names.push_back(render::name_of(material));
    const auto check = [](io::Section& in, const char* key, const toml::node* node,
                          const std::filesystem::path& path) {
        try {
            return patient::content_hash(path);
        } catch (const io::InputError& error) {
            if (node) in.refuse(key, *node, error.what());
            return std::uint64_t{0};
        }
    };
    geometry::Hash hash;
    if (!files.ct.empty()) hash.add(check(section, "ct", ct, files.ct));
    for (io::Section& mesh : section.sections("mesh")) {
        patient::PatientMesh wanted;
        const toml::node* node = mesh.find("file");
        if (mesh.word("file", name)) {
            wanted.file = folder / name;
            hash.add(check(mesh, "file", node, wanted.file));
        } else if (!node) {
            mesh.missing("file", "file = \"MESH\" of a patient's mesh");
        }
        if (const auto material = mesh.choice("material", names))
            wanted.material = mesh_materials[*material];
        else if (!mesh.find("material"))
            mesh.missing("material", "material of a patient's mesh");
        if (const auto inside = mesh.choice("inside", names)) wanted.inside = mesh_materials[*inside];
        constexpr std::string_view axes[] = {"lps", "ras"}, units[] = {"mm", "cm", "m"};
        constexpr double in_mm[] = {1, 10, 1000};
        if (const auto taken = mesh.choice("axes", axes)) wanted.axes = axes[*taken];
        if (const auto unit = mesh.choice("unit", units)) wanted.unit = in_mm[*unit];
        mesh.point("shift_mm", wanted.shift, 1e4);
        if (mesh.point("rotation_deg", wanted.rotation, 360)) wanted.rotation *= geometry::degree;
        mesh.finish();
        files.meshes.push_back(std::move(wanted));
    }
    section.finish();
    files.content = hash.value();
}

void read_motion(io::Section motion, Scenario& s) {
    motion.number("heart_rate_per_min", s.motion.heart_rate, {20, 240});
    motion.point("heart_reach_mm", s.motion.heart_reach, 30);
    motion.number("breathing_rate_per_min", s.motion.breathing_rate, {4, 60});
    motion.point("breathing_reach_mm", s.motion.breathing_reach, 60);
    motion.number("breath_hold_s", s.motion.breath_hold, {1, 120});
    motion.finish();
}

void read_contrast(io::Section contrast, Scenario& s) {
    double weight = 75, creatinine = 1;
    contrast.number("weight_kg", weight, {20, 250});
    contrast.number("creatinine_mg_per_dl", creatinine, {0.2, 15});
    s.blood.limit = blood::contrast_limit(weight, creatinine);
    contrast.number("limit_ml", s.blood.limit, {0, 1000});
    contrast.word("blood_from", s.blood.source);
    contrast.number("inflow_ml_per_s", s.blood.inflow, {0.01, 500});
    contrast.number("systolic_mmHg", s.blood.systolic, {50, 300});
    contrast.number("diastolic_mmHg", s.blood.diastolic, {20, 200});
    contrast.finish();
}

/// Adds a value to the hash: its type, then what it holds; tables in the order of their keys.
void add_to(geometry::Hash& hash, const toml::node& node) {
    const auto text = [&hash](std::string_view value) {
        hash.add(std::uint64_t{value.size()});
        hash.add(value.data(), value.size());
    };
    hash.add(static_cast<std::uint64_t>(node.type()));
    if (const toml::table* table = node.as_table()) {
        hash.add(std::uint64_t{table->size()});
        for (const auto& [key, value] : *table) {
            text(key.str());
            add_to(hash, value);
        }
    } else if (const toml::array* array = node.as_array()) {
        hash.add(std::uint64_t{array->size()});
        for (const toml::node& value : *array) add_to(hash, value);
    } else if (const auto string = node.value_exact<std::string>()) {
        text(*string);
    } else if (const auto number = node.value<double>()) {
        hash.add(*number);
    }
}

/// Of what is played: words for people and limits change no state.
std::uint64_t content_of(const toml::table& root, const Scenario& s) {
    toml::table played = root;
    for (const std::string_view key : {"title", "lesson", "time_limit_s", "beam_limit_s"}) played.erase(key);
    geometry::Hash hash;
    add_to(hash, played);
    for (const PlacedDevice& placed : s.devices) hash.add(geometry::state_hash_of(placed.device));
    if (s.patient_files.content != 0) hash.add(s.patient_files.content);
    return hash.value();
}

void read_sections(const toml::table& root, const std::filesystem::path& catalogue, io::ParseContext& reading,
                   Scenario& s) {
    io::Section top(reading, &root, "");
    top.schema();
    if (!top.word("title", s.title)) top.missing("title", "title");
    top.number("frame_rate_hz", s.frame_rate, {0.5, 120});
    top.number("time_limit_s", s.time_limit, {0.1, 1e5});
    top.number("beam_limit_s", s.beam_limit, {0.1, 1e5});
    top.whole("seed", s.seed, {0, 9e15});
    read_anatomy(top, reading, s);

    read_tube(top.section("tube", false), reading, s);
    s.catalogue = catalogue;
    read_devices(top, reading.file, s);
    read_entry(top.section("entry", true), s);
    read_chain(top.section("chain", false), s);
    io::Section wall = top.section("wall", false);
    wall.number("stiffness_N_per_mm", s.wall_stiffness, {1e-3, 1e6});
    wall.number("friction", s.wall_friction, {0, 10});
    constexpr std::string_view models[] = {"auto", "analytic", "distance-field", "mesh"};
    if (const auto model = wall.choice("model", models)) s.wall_model = static_cast<WallModel>(*model);
    read_variation(wall.section("variation", false), s);
    wall.finish();
    read_tissue(top.section("tissue", false), s.tissue);
    read_injury(top.section("injury", false), s.injury);
    read_relaxer(top.section("relaxer", false), s);
    read_lesions(top, s);
    io::Section target = top.section("target", true);
    target.word("name", s.target.name);
    if (Vec3 centre; target.point("centre_mm", centre, 1e4)) s.target.centre = centre;
    target.number("radius_mm", s.target.radius, {0.1, 100});
    target.number("hold_s", s.target.hold, {0, 60});
    if (const toml::node* node = target.find("residual_percent"); node && s.lesions.empty())
        target.refuse("residual_percent", *node, "expected it only with a [[lesion]], found none");
    target.number("residual_percent", s.target.residual, {0, 100});
    if (const auto tip = target.choice("device", script::device_names()))
        s.target.device = static_cast<script::DeviceRole>(*tip);
    target.finish();
    read_c_arm(top.section("c_arm", false), s);
    read_imaging(top.section("imaging", false), s);
    read_patient(top.section("patient", false), reading.file, s);
    read_motion(top.section("motion", false), s);
    s.blood.heart_rate = s.motion.heart_rate;
    read_contrast(top.section("contrast", false), s);
    read_lesson(top.section("lesson", false), s.lesson);
    if (const toml::node* par = top.find("par"))
        reading.refuse(par->source(), fmt::format("[par] is no longer read: attempts are measured by skilled "
                                                  "ones; 'seldinger benchmark' makes {} of recordings",
                                                  benchmark_file));
    top.finish();
    s.content = content_of(root, s);
}

/// Sets the value of a dotted key; sections that are missing are made. A target by name takes the place of
/// one by coordinates, and the other way round.
void put(toml::table& root, const Override& with) {
    const auto refuse = [&with](const std::string& why) {
        throw io::InputError("{} = {}: {}", with.key, with.value, why);
    };
    toml::table parsed;
    try {
        parsed = toml::parse("value = " + with.value, fmt::format("{} = {}", with.key, with.value));
    } catch (const toml::parse_error& error) {
        // A text has quotes, and a shell takes quotes away.
        refuse(
            with.value.find_first_of("\"'[]{}") == std::string::npos
                ? fmt::format("expected a number, true, false, or a text in quotes, in a shell '{}=\"{}\"'",
                              with.key, with.value)
                : fmt::format("this is not TOML: {}", error.description()));
    }
    if (parsed.size() != 1 || !parsed.contains("value")) refuse("expected one value");
    toml::table* table = &root;
    std::string_view left = with.key;
    for (std::size_t dot; (dot = left.find('.')) != std::string_view::npos; left.remove_prefix(dot + 1)) {
        const std::string_view section = left.substr(0, dot);
        if (!table->contains(section)) table->insert(section, toml::table());
        table = table->get(section)->as_table();
        if (!table) refuse(fmt::format("'{}' is no section", section));
    }
    if (left.empty()) refuse("expected a key such as guidewire.friction");
    if (with.key == "target.name" || with.key == "target.centre_mm")
        table->erase(left == "name" ? "centre_mm" : "name");
    parsed.get("value")->visit([&](auto& value) { table->insert_or_assign(left, std::move(value)); });
}

}  // namespace

Scenario parse_scenario(const std::string& text, const std::filesystem::path& file,
                        const std::filesystem::path& catalogue, std::span<const Override> overrides) {
    io::ParseContext reading{file.string(), {}, {}};
    Scenario s;
    s.name = file.stem().string();
    toml::table root = reading.parse(text);
    for (const Override& with : overrides) put(root, with);
    read_sections(root, catalogue, reading, s);
    reading.places[""] = {reading.file, 0, 0};
    s.places = std::move(reading.places);
    s.patient_files.place = s.place("patient.ct");
    for (std::size_t i = 0; i < s.patient_files.meshes.size(); ++i)
        s.patient_files.meshes[i].place = s.place("mesh " + std::to_string(i + 1) + ".file");
    reading.end();
    s.files.insert(s.files.end(), reading.files.begin(), reading.files.end());
    s.files.push_back(file);
    if (const std::vector<std::string> wrong = problems(s); !wrong.empty())
        throw io::InputError(io::joined(wrong, "\n"));
    return s;
}

Scenario load_scenario(const std::filesystem::path& path, const std::filesystem::path& catalogue,
                       std::span<const Override> overrides, const std::string& patient) {
    const std::string text = io::read_text(path, "scenario", "expected a .toml file");
    Scenario s = parse_scenario(text, path, catalogue, overrides);
    if (!patient.empty() && patient != "1") {
        const LessonPatient wanted = patient_of(s, patient);
        std::vector<Override> with;
        for (const auto& [key, value] : wanted.values) with.push_back({"anatomy." + key, value});
        with.insert(with.end(), overrides.begin(), overrides.end());
        s = parse_scenario(text, path, catalogue, with);
        s.patient = patient;
        s.patient_who = wanted.who;
        if (!wanted.indication.empty()) s.lesson.indication = wanted.indication;
    }
    s.lesson.benchmark = benchmark_in(path.parent_path(), s.name);
    if (s.lesson.benchmark.given()) s.files.emplace_back(s.lesson.benchmark.file);
    return s;
}

}  // namespace scenario
