#include "engine/studies/pareto_methods.h"

#include <fmt/format.h>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/scenes.h"
#include "engine/run/relax_method.h"
#include "engine/studies/baselines/beam_rod.h"
#include "engine/studies/baselines/position_rod.h"
#include "engine/studies/baselines/spring_chain.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using physics::RelaxerKind;

class OwnRunner final : public ParetoRunner {
public:
    OwnRunner(const ParetoVessel& vessel, const physics::RelaxerConfig& config, bool distal)
        : relaxer_(physics::make_relaxer(config, *vessel.wall)),
          global_(config.kind == RelaxerKind::Global),
          distal_(distal) {}
    void remember(const Chain& rest) override {
        Chain wire = rest;
        if (global_) relaxer_->relax(wire, {1'000'000'000, 0, 0});
    }
    void start(const Chain& wire) override { wire_ = wire; }
    bool advance(int rounds) override {
        // A round is N updates. The global relaxer makes a step whatever the budget.
        const int updates = global_ && rounds == 1 ? 1 : rounds * wire_.segments();
        const auto report = relaxer_->relax(wire_, {updates, distal_ ? 0.75 : 0.0, distal_ ? 60 : 0});
        work_.rounds += global_ ? report.newton_steps : rounds;
        work_.wall_queries += static_cast<double>(report.wall_queries);
        work_.solves += global_ ? report.newton_steps : report.updates;
        at_rest_ = report.converged();
        return at_rest_;
    }
    const std::vector<geometry::Vec3>& joints() const override { return wire_.joints; }
    ParetoWork work() const override { return work_; }
    std::string end() const override { return at_rest_ ? "at rest" : "went on"; }

private:
    std::unique_ptr<physics::Relaxer> relaxer_;
    bool global_, distal_;
    Chain wire_;
    ParetoWork work_;
    bool at_rest_ = false;
};

class BaselineRunner final : public ParetoRunner {
public:
    explicit BaselineRunner(std::unique_ptr<baselines::Baseline> rival) : baseline_(std::move(rival)) {}
    void start(const Chain& wire) override { baseline_->start(wire.joints); }
    bool advance(int rounds) override {
        progress_ = baseline_->advance(rounds);
        return progress_ != baselines::Progress::Going;
    }
    const std::vector<geometry::Vec3>& joints() const override { return baseline_->nodes(); }
    ParetoWork work() const override {
        const baselines::Tally& t = baseline_->tally();
        return {static_cast<double>(t.rounds), static_cast<double>(t.wall_queries),
                static_cast<double>(t.solves)};
    }
    std::string end() const override {
        using baselines::Progress;
        return progress_ == Progress::AtRest     ? "at rest"
               : progress_ == Progress::Stuck    ? "stuck"
               : progress_ == Progress::Diverged ? "diverged"
                                                 : "went on";
    }

private:
    std::unique_ptr<baselines::Baseline> baseline_;
    baselines::Progress progress_ = baselines::Progress::Going;
};

ParetoMethod drawn(ParetoMethod method, const std::string& colour, const std::string& rest) {
    method.colour = colour;
    method.look = fmt::format("lc rgb '{}' {}", colour, rest);
    return method;
}

/// A classical method; `make` takes the rod, whose EA is `axial` times as large, and the tube.
template <class Make>
ParetoMethod classical(const std::string& name, double axial, const Make& make) {
    ParetoMethod m;
    m.name = name;
    m.family = Family::Classical;
    m.make = [axial, make](const ParetoVessel& v, bool) {
        baselines::RodSpec rod = v.rod;
        rod.axial *= axial;
        return std::make_unique<BaselineRunner>(make(rod, v.tube.get()));
    };
    return m;
}

/// One that takes many cheap rounds, at most so many a push.
ParetoMethod of_many_rounds(ParetoMethod m, int rounds, const char* round, const char* solve) {
    m.first = 4;
    m.most_push = rounds;
    m.most_cold = 4 * rounds;
    m.round = round;
    m.solve = solve;
    return m;
}

ParetoMethod position_rod(const std::string& name, const baselines::PositionSettings& settings, int rounds) {
    const auto make = [settings](const baselines::RodSpec& rod, const baselines::Tube* tube) {
        return std::make_unique<baselines::PositionRod>(rod, tube, settings);
    };
    return of_many_rounds(classical(name, 1, make), rounds, "a substep", "the projection of one constraint");
}

ParetoMethod spring_chain(const std::string& name, baselines::Damping damping, double axial, int rounds) {
    const auto make = [damping](const baselines::RodSpec& rod, const baselines::Tube* tube) {
        return std::make_unique<baselines::SpringChain>(rod, tube, damping);
    };
    return of_many_rounds(classical(name, axial, make), rounds, "a time step", "none");
}

ParetoMethod beam_rod(const std::string& name, double axial) {
    ParetoMethod m = classical(name, axial, [](const baselines::RodSpec& rod, const baselines::Tube* tube) {
        return std::make_unique<baselines::BeamRod>(rod, tube);
    });
    m.newton = true;
    m.most_push = 200;
    m.most_cold = 1000;
    m.round = "a Newton step";
    m.solve = "a factorisation of the 5N × 5N tangent";
    return m;
}

std::shared_ptr<const baselines::Tube> rivals_tube(const anatomy::Scene& scene) {
    std::vector<baselines::Piece> pieces;
    for (const anatomy::PenMove& move : scene.path) {
        if (const auto* run = std::get_if<anatomy::Run>(&move)) {
            pieces.push_back({run->length, 0, geometry::Vec3::UnitZ()});
            continue;
        }
        const auto& arc = std::get<anatomy::Arc>(move);
        pieces.push_back({arc.radius * std::abs(arc.angle), arc.angle, arc.axis});
    }
    return std::make_shared<baselines::Tube>(pieces, scene.radius);
}

/// The tube as about 50 000 triangles.
ParetoVessel mesh_of(const char* name, const anatomy::ModelCache& cache) {
    ParetoVessel v = scene_vessel(name, false);
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    const anatomy::Anatomy tube = anatomy::tube_anatomy(v.name, v.path, scene.radius, 64, 0.1 * scene.radius);
    v.wall = anatomy::cached_distance_field(tube, scene.wall_stiffness, 0.0, cache);
    v.name += " mesh";
    v.tube.reset();
    return v;
}

/// From the left groin into the aorta, with a floppy-tipped wire that is straight when unloaded.
ParetoVessel iliac(const StudyOptions& options) {
    const anatomy::Anatomy anatomy =
        anatomy::generated_anatomy(anatomy::vessel_preset("iliac-renal"), options.cache);
    ParetoVessel v;
    v.name = "iliac mesh";
    v.path = anatomy::path_from(anatomy, *anatomy::find_end(anatomy, "aorta+LCIA+LEIA+LCFA.out")).points;
    v.spec.curved_length = v.spec.curved_angle = 0;
    v.segments = 165;
    v.stiffness = 5;
    v.wall = anatomy::cached_distance_field(anatomy, v.stiffness, 0.5 * v.spec.diameter, options.cache);
    return v;
}

}  // namespace

ParetoMethod own_method(const std::string& word, const std::string& name) {
    const physics::RelaxerConfig config = run::parse_method(word);
    ParetoMethod m;
    m.name = name;
    const bool global = config.kind == RelaxerKind::Global;
    m.family = global ? Family::Global : Family::Paper;
    m.newton = global;
    // About half a second a push and a few from the centreline.
    const int m_turns = config.kind == RelaxerKind::Segment ? config.varied_segments : 1;
    m.most_push = global ? 300 : m_turns > 3 ? 512 : 1024;
    m.most_cold = global ? 1000 : m_turns > 3 ? 3000 : 5000;
    m.round = global ? "a Newton step" : "N updates";
    m.solve = global ? "an O(N) recursion" : fmt::format("an update of {} unknowns", 2 * m_turns);
    m.make = [config](const ParetoVessel& v, bool distal) {
        return std::make_unique<OwnRunner>(v, config, distal);
    };
    return m;
}

std::vector<ParetoMethod> pareto_methods(bool quick) {
    std::vector<ParetoMethod> list;
    const auto own = [&](const char* word, const char* name, const char* colour, const char* rest) {
        list.push_back(drawn(own_method(word, name), colour, rest));
    };
    own("first-order", "first order", "#999999", "lw 1.5");
    own("segment:1", "M = 1", "#E69F00", "lw 1.5");
    own("segment:2", "M = 2", "#0072B2", "lw 1.5");
    own("segment:3", "M = 3", "#56B4E9", "lw 1.5");
    if (!quick) {
        own("segment:5", "M = 5", "#56B4E9", "lw 1.5 dt 2");
        own("konings", "Konings", "#999999", "lw 1.5 dt 2");
        own("geometric", "geometrical", "#999999", "lw 1.5 dt 4");
        own("combined:2", "geometrical and M = 2", "#0072B2", "lw 1.5 dt 4");
    }
    own("global", "global Newton", "#D55E00", "lw 3.5");
    // Settings as chosen from rival_sweep().
    list.push_back(drawn(position_rod("XPBD", {0.01, 1, false, false}, 32'000), "#CC79A7", "lw 2.5"));
    list.push_back(
        drawn(position_rod("XPBD warm-started", {0.1, 16, false, true}, 2000), "#CC79A7", "lw 2.5 dt 2"));
    list.push_back(
        drawn(spring_chain("mass–spring", baselines::Damping::Critical, 1, 32'000), "#009E73", "lw 2.5"));
    list.push_back(drawn(beam_rod("beam FEM", 1), "#000000", "lw 2.5"));
    return list;
}

std::vector<ParetoMethod> rival_sweep(bool quick) {
    std::vector<ParetoMethod> list;
    const auto xpbd = [&](double step, int iterations, bool momentum, bool warm) {
        list.push_back(position_rod(
            fmt::format("XPBD, Δt²/m = {:g} mm/N, {} iteration{}, {}, {}", step, iterations,
                        iterations == 1 ? "" : "s", momentum ? "velocities carried" : "velocities dropped",
                        warm ? "multipliers carried" : "multipliers from zero"),
            {step, iterations, momentum, warm}, 32'000 / iterations));
    };
    if (quick) {
        xpbd(0.01, 1, true, false);
    } else {
        for (const double step : {1e-4, 1e-3, 1e-2, 0.1}) xpbd(step, 1, true, false);
        for (const double step : {1e-3, 1e-2, 0.1, 1.0}) xpbd(step, 1, false, false);
        for (const int iterations : {4, 16}) xpbd(0.01, iterations, true, false);
        for (const double step : {1e-2, 0.1, 1.0}) xpbd(step, 4, false, true);
        for (const double step : {0.1, 1.0}) xpbd(step, 8, false, true);
        for (const double step : {0.1, 1.0, 10.0}) xpbd(step, 16, false, true);
    }
    for (const auto damping : {baselines::Damping::Kinetic, baselines::Damping::Critical})
        for (const double axial : {0.1, 1.0, 10.0}) {
            if (quick && axial != 1) continue;
            list.push_back(spring_chain(
                fmt::format("mass–spring, {} damping, EA × {:g}",
                            damping == baselines::Damping::Kinetic ? "kinetic" : "critical", axial),
                damping, axial, 32'000));
        }
    for (const double axial : {0.1, 1.0, 10.0, 1000.0}) {
        if (quick && axial != 1) continue;
        list.push_back(beam_rod(fmt::format("beam FEM, EA × {:g}", axial), axial));
    }
    return list;
}

std::string ParetoVessel::text() const {
    const std::string tip =
        spec.tip_rigidity == spec.shaft_rigidity ? "" : fmt::format(" (tip {:g})", spec.tip_rigidity);
    return fmt::format("{}: N = {}, λ = {:g} mm, EI = {:g} N·mm²{}, k = {:g} N/mm", name, segments,
                       spec.segment_length, spec.shaft_rigidity, tip, stiffness);
}

physics::Chain ParetoVessel::wire(int n) const {
    physics::Chain wire = wire_along(spec, path, n);
    const auto contacts = physics::all_contacts(wire, *wall);
    for (std::size_t i = 0; i < contacts.size(); ++i) wire.stations[i] = contacts[i].station;
    return wire;
}

double round_wire_axial(double bending) {
    constexpr double diameter = 0.014 * 25.4;
    return 16 * bending / (diameter * diameter);
}

ParetoVessel scene_vessel(const char* name, bool quick) {
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    ParetoVessel v;
    v.name = name;
    v.path = anatomy::draw(scene.path);
    v.spec = PlainWire::uniform(scene.rigidity, scene.segment_length);
    v.segments = quick ? 60 : scene.segments;
    v.stiffness = scene.wall_stiffness;
    v.wall = std::make_shared<physics::TubeWall>(v.path, scene.radius, v.stiffness);
    v.tube = rivals_tube(scene);
    v.rod.segment_length = scene.segment_length;
    v.rod.bending = scene.rigidity;
    v.rod.axial = round_wire_axial(scene.rigidity);
    v.rod.wall_stiffness = scene.wall_stiffness;
    return v;
}

std::vector<ParetoVessel> pareto_tubes(bool quick) {
    if (quick) return {scene_vessel("sinuous", true)};
    std::vector<ParetoVessel> list;
    for (const char* name : {"sinuous", "spatial", "hairpin", "stiffwall"})
        list.push_back(scene_vessel(name, false));
    return list;
}

std::vector<ParetoVessel> pareto_meshes(const StudyOptions& options) {
    if (options.quick) return {};
    return {mesh_of("spatial", options.cache), iliac(options)};
}

}  // namespace studies
