#pragma once
/// An exercise as its author writes it: which vessel, devices, target, view. Units inside as everywhere: mm,
/// N, s, rad.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/grow/vessel_tree.h"
#include "engine/anatomy/model_cache.h"
#include "engine/anatomy/scenes.h"
#include "engine/blood/blood_flow.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/patient/patient_files.h"
#include "engine/scenario/benchmark.h"
#include "engine/scenario/breathing.h"
#include "engine/scenario/device.h"
#include "engine/script/action.h"
#include "engine/script/command.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/opening.h"
#include "physics/wall/wall_stiffness.h"
#include "physics/wire/refinement.h"
#include "render/xray/c_arm.h"

namespace scenario {

/// A view that shows what matters.
struct SuggestedView {
    std::string shows;
    double lao = 0, cranial = 0;  // [rad]
};

/// One step of a guided lesson: the room shows it until all of it was done.
struct LessonStep {
    std::vector<script::Practice> practise;
    std::string text;  // what to do, and why
};

/// Another patient of the same exercise: what stands in place of [anatomy]'s own, so that a preset grows
/// other vessels.
struct LessonPatient {
    std::string who;                                          // "woman, 81"
    std::string indication;                                   // empty: the lesson's
    std::vector<std::pair<std::string, std::string>> values;  // keys of [anatomy] and their TOML
};

/// What an exercise is for: its place in the curriculum, what the trainee is shown, and what it is measured
/// by.
struct Lesson {
    static constexpr int levels = 4;
    int level = 0;           // 1 to 4; 0 = outside the curriculum
    std::string indication;  // the patient, and why this is done
    std::string briefing;
    std::vector<std::string> hints;
    std::vector<SuggestedView> views;
    std::vector<LessonStep> steps;        // empty: no guided lesson
    std::vector<LessonPatient> patients;  // from the second on; the first is the scenario's own
    Benchmark benchmark;                  // of the first patient

    /// Passed by doing all steps, not by points: there is no grade.
    bool guided() const { return !steps.empty(); }
};

/// A synthetic vessel in place of an anatomy file.
struct TubeSource {
    std::string scene;                   // name of one of scenes(); empty = `path` is given
    std::vector<anatomy::PenMove> path;  // from the origin heading +x
    double radius = 2;                   // [mm]
    int around = 48;                     // facets round the lumen
    double step = 0.5;                   // length of a facet [mm]
};

/// What the wire touches.
enum class WallModel {
    Auto,           // Analytic for a tube, else as choose_model finds
    Analytic,       // a tube in closed form
    DistanceField,  // of the lumen's mesh: smooth, so that a frame ends in equilibrium
    Mesh            // the mesh's own planes by ray, as in the paper
};

constexpr double french = 1.0 / 3;  // of a diameter [mm]

struct Entry {
    std::string end;             // name of the open end that the devices come in by
    double sheath = 0;           // bore of the introducer sheath there, a diameter; 0 = usual_sheath() [mm]
    double sheath_length = 110;  // of a short introducer (10 to 11 cm in catalogues) [mm]
    /// Branch at whose start a flush catheter from another access ends from the beginning on; empty = none.
    std::string flush_catheter = {};
};

struct Target {
    std::string name;                      // of a target of the anatomy; empty = `centre` is given
    std::optional<geometry::Vec3> centre;  // [mm]
    double radius = 3;                     // the tip is on target within this [mm]
    double hold = 0.5;                     // and must stay so long [s]
    script::DeviceRole device = script::DeviceRole::Wire;  // whose tip it is
    /// And no lesion may have more of its diameter left to open than this, with its balloon empty; empty = it
    /// is the tip alone that counts [percent].
    std::optional<double> residual = {};
};

struct Imaging {
    double detector_dose = 30;  // a pulse at the detector [nGy]
    double iodine = 0;          // contrast that fills the lumen at the start [mg/ml]
    bool patient = true;        // a body around the vessel; off = the vessel and wire in air
    /// Of the room, around that body: table top and mattress, electrodes on the chest.
    bool table = true, leads = true;
    double acquisition_dose = 1000;  // a pulse of DSA at the detector [nGy]
    double cine_dose = 150;          // a pulse of cine at the detector [nGy]
    /// What the acquisition pedal takes: DSA or cine.
    script::ImagingMode acquisition = script::ImagingMode::Dsa;
    std::optional<double> kvp;         // tube voltage [kV]; empty = automatic
    std::optional<double> pulse_rate;  // [1/s]; empty = a pulse every frame
};

/// How a turn of a hub reaches the tip of a device that has a torsional rigidity.
enum class TorsionModel {
    Auto,       // the least of the others that choose_model finds to be needed
    Rigid,      // at once
    Compliant,  // through a shaft that winds up as a whole
    Segments    // through one that twists segment by segment, and that friction holds back all along
};

/// A device of the catalogue, with the scenario's values in place of its own, and where it begins.
struct PlacedDevice {
    script::DeviceRole role = script::DeviceRole::Wire;  // by which commands call it; not All
    Device device;
    double inserted = 0;                 // inside at the start, along the centreline [mm]
    double roll = 0;                     // of its shape at the start [rad]
    bool pinned = true;                  // a hand holds it while others are moved; else its valve alone does
    std::string section;                 // of the file that says so
    std::vector<std::string> tray = {};  // balloons and stents of the catalogue, or files, to change to

    std::string_view name() const { return script::name_of(role); }
    /// Whether it lies in the vessel at the start. What does not fit the way in stops there, and says so.
    bool starts_inside() const { return role == script::DeviceRole::Wire || inserted > 0; }
};

/// Of which kinds a device in this role may be.
std::span<const DeviceKind> kinds_of(script::DeviceRole);

/// Shaft between hand and valve [mm] for which buckling forces are stated: with it the Euler loads of the
/// catalogue's wires are about the forces that models of vessels saw.
inline constexpr double free_shaft = 100;

/// What the vessels lie in: anatomy::tissues_of(), with what a scenario changes.
struct TissueChoice {
    /// Of one vessel, or of all: k_f and E h/R of physics::Tissue [N/mm²]; empty = that of its kind.
    struct Values {
        std::string vessel;  // name of a branch, or empty
        std::optional<double> modulus, wall;
    };
    std::optional<bool> rigid;  // vessels stay where they are; empty = vessels_move() says
    Values all;
    std::vector<Values> vessels;  // before those of all

    void state(geometry::StateStream&);
};

/// What the wall bears under the end of a device; sources and range in docs/injury.md.
struct InjurySpec {
    bool off = false;               // the wall bears everything
    double perforation = 0.84;      // strength of the wall against shear across its layers [N/mm²]
    double dissection = 0.17;       // and between them [N/mm²]
    double wall_over_radius = 0.2;  // thickness of the wall over the vessel's radius [-]
    /// End-on forces, in place of what follows from the strengths, at every place and for every device [N].
    std::optional<double> perforation_force, dissection_force;

    void state(geometry::StateStream& s) {
        s(off, perforation, dissection, wall_over_radius, perforation_force, dissection_force);
    }
};

/// A narrow place of a vessel that can be treated: plaque in a lumen that is, without it, as the anatomy has
/// it.
struct LesionSpec {
    std::string branch;
    double at = 0, length = 0;  // of its middle from the branch's origin, along it [mm]
    double percent = 0;         // of the diameter, lost in its middle
    double eccentricity = 0;    // 0: from all sides; 1: from one, while the wall opposite stays [-]
    double angle = 0;  // of the plaque's side about the branch; 0 = as seen from the front, aside [rad]
    physics::Plaque plaque = physics::Plaque::Fibrous;
    /// Where a stent is to begin and end, from the branch's origin, negative in the vessel that it leaves;
    /// empty = no stent is planned [mm].
    std::optional<std::pair<double, double>> stent;
};

struct Scenario {
    std::string name;                  // of the file, without folder and extension
    std::string title;                 // one line, shown by `seldinger list`
    std::string patient;               // "2", "seed:17"; empty = the first
    std::string patient_who;           // "woman, 81"
    double frame_rate = 15;            // [1/s]
    std::optional<double> time_limit;  // the exercise ends here, reached or not [s]
    std::optional<double> beam_limit;  // and here, of the beam [s]
    Lesson lesson;
    std::uint64_t content = 0;  // hash of what is played: of the file without words for people, of devices
    std::uint64_t seed = 1;     // of the noise in the images
    // One of three vessels.
    std::filesystem::path anatomy;  // NAME.anatomy.json
    std::optional<anatomy::VesselTreeSpec> vessels;
    std::optional<TubeSource> tube;
    Entry entry;
    std::vector<PlacedDevice> devices;   // on one centreline, innermost first; the first is a wire
    std::filesystem::path catalogue;     // folder of devices, from which a wire is exchanged
    double segment_length = 2;           // λ of the chain of devices [mm]
    bool choose_segment_length = false;  // segment_length_mm = "auto": λ as choose_model finds
    bool adaptive = false;               // λ fine at the tip and in bends, coarse elsewhere
    std::optional<double> tip_error;     // segments keep it, by its estimate; empty = λ [mm]
    TorsionModel torsion = TorsionModel::Auto;
    physics::RefinementOptions refinement;
    double wall_stiffness = 5;                             // k of each joint of λ [N/mm]
    std::optional<physics::WallVariation> wall_variation;  // Eq. 41; empty = as stiff everywhere
    double wall_friction = 1;                              // scales the devices' friction
    WallModel wall_model = WallModel::Auto;
    TissueChoice tissue;
    InjurySpec injury;
    physics::RelaxerConfig relaxer;
    double hand_distance = free_shaft;                // at the start, from each hand to its valve [mm]
    physics::RelaxBudget budget = {80000, 0.75, 60};  // work of one frame
    Target target;
    std::vector<LesionSpec> lesions;
    render::CArm c_arm;  // at the start
    Imaging imaging;
    patient::PatientFiles patient_files;
    VesselMotion motion;
    blood::FlowSpec blood;  // its heart rate is that of the motion

    std::vector<std::filesystem::path> files;     // its own, and those of devices and of a tree of vessels
    std::map<std::string, io::TextPlace> places;  // "guidewire.diameter_mm" → where the file says so
    io::TextPlace place(const std::string& key) const;  // of the key, or its section, or the file

    /// "patient 2: woman, 81"; empty for the first.
    std::string patient_text() const;
    const PlacedDevice& wire() const { return devices.front(); }
    PlacedDevice& wire() { return devices.front(); }
    /// Place in the list; empty where the scenario has no such device.
    std::optional<int> index_of(script::DeviceRole) const;
    /// What is found of a device and its section, for messages.
    io::TextPlace place_of(const PlacedDevice& device, const std::string& key) const {
        return place(device.section + "." + key);
    }
    /// Of any device that the wall can meet [mm]. A wire in exchange fits the others' lumens.
    double thickest_radius() const;
    /// Bore of the sheath that takes all devices: the next whole French size up from the largest, 4 F or
    /// more; a sheath is named by the largest device that it takes [mm].
    double usual_sheath() const;
};

/// A value in place of the file's: "guidewire.friction", "0.1"; the value is TOML.
struct Override {
    std::string key, value;
};

/// Throws InputError that lists everything wrong, a line each, with file:line:column.
/// `catalogue` is the folder that holds the devices a scenario takes by name. A loaded scenario has the
/// benchmark of its folder. `patient`: a number in the list of the lesson's patients, or "seed:17" for one
/// drawn from a seed; empty or "1" is the first.
Scenario load_scenario(const std::filesystem::path&, const std::filesystem::path& catalogue,
                       std::span<const Override> = {}, const std::string& patient = {});
Scenario parse_scenario(const std::string& toml, const std::filesystem::path& file,
                        const std::filesystem::path& catalogue, std::span<const Override> = {});

/// Everything about the scenario alone that makes it unusable; empty when it is fine.
std::vector<std::string> problems(const Scenario&);

/// The vessel of the scenario, loaded, grown or drawn, with the sheath at its entry. Throws InputError.
anatomy::Anatomy anatomy_of(const Scenario&, const anatomy::ModelCache& = {});

/// Every file and folder that is read for the scenario: its own, of its devices, vessels and patient. No
/// output of a command may be one of them.
std::vector<std::filesystem::path> inputs_of(const Scenario&);
/// To be called before any work: throws InputError where an output is one of those, one of `more` that is
/// read, or another output.
void require_no_input(const std::vector<io::Output>&, const Scenario&,
                      std::vector<std::filesystem::path> more = {});

/// Scenario files (*.toml) of a folder by name, in alphabetical order.
std::vector<std::filesystem::path> shipped_scenarios(const std::filesystem::path& folder);

}  // namespace scenario
