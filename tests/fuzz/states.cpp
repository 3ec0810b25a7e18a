#include "tests/fuzz/states.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <optional>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/model_cache.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/room/keys.h"
#include "physics/geometry/mesh_query.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"

namespace fuzz {
namespace {

class Dice {
public:
    explicit Dice(std::uint32_t seed) : random_(seed) {}
    double draw(double from, double to) { return from + (to - from) * (random_() / 4294967296.0); }
    /// Evenly over the magnitudes.
    double magnitude(double from, double to) { return std::exp(draw(std::log(from), std::log(to))); }
    bool one_in(int n) { return draw(0, n) < 1; }
    template <std::size_t N>
    const char* of(const std::array<const char*, N>& words) {
        return words[static_cast<std::size_t>(draw(0, N))];
    }

private:
    std::mt19937 random_;
};

constexpr std::uint32_t trees = 60;  // as many different ones; each takes a while to grow

std::string point(const std::array<double, 4>& p) {
    return fmt::format("[{:.2f}, {:.2f}, {:.2f}, {:.2f}]", p[0], p[1], p[2], p[3]);
}

/// A branch that bends at random from its first point on, with a radius that changes on the way.
std::string random_branch(Dice& dice, std::array<double, 4> at, double heading, double climb, double step,
                          int steps) {
    std::string text = "points_mm = [" + point(at);
    for (int k = 0; k < steps; ++k) {
        at[0] += step * std::cos(heading) * std::cos(climb);
        at[1] += step * std::sin(heading) * std::cos(climb);
        at[2] += step * std::sin(climb);
        at[3] *= dice.draw(0.8, 1.1);
        heading += dice.draw(-0.4, 0.4);
        climb += dice.draw(-0.3, 0.3);
        text += ", " + point(at);
    }
    return text + "]\n";
}

/// A vessel with laterals, with or without a narrow or a wide place.
std::string random_tree(std::uint32_t number) {
    Dice dice(1'000'000 + number);
    const double radius = dice.magnitude(1.2, 8), step = std::max(25.0, 5 * radius);
    const int steps = 5;
    std::string text =
        "[anatomy]\n[[anatomy.branch]]\nname = \"main\"\n" +
        random_branch(dice, {0, 0, 0, radius}, dice.draw(-0.3, 0.3), dice.draw(-0.3, 0.3), step, steps);
    const int laterals = static_cast<int>(dice.draw(1, 4));
    for (int k = 0; k < laterals; ++k) {
        const double own = radius * dice.draw(0.3, 0.8);
        text += fmt::format("[[anatomy.branch]]\nname = \"side{}\"\nparent = \"main\"\nat_mm = {:.1f}\n", k,
                            step * dice.draw(1.2 + k, 1.8 + k));
        text += random_branch(dice, {0, 0, 0, own}, (k % 2 ? -1 : 1) * dice.draw(0.5, 2.2),
                              dice.draw(-0.5, 0.5), std::max(14.0, 1.5 * radius), 3);
    }
    if (dice.one_in(3))
        text += fmt::format(
            "[[anatomy.stenosis]]\nbranch = \"main\"\nat_mm = {:.1f}\nlength_mm = {:.1f}\npercent = {:.0f}\n",
            step * dice.draw(2, 4), dice.draw(2, 5) * radius, dice.draw(20, 70));
    if (dice.one_in(4))
        text += fmt::format(
            "[[anatomy.tortuosity]]\nbranch = \"main\"\namplitude_mm = {:.1f}\nwavelength_mm = {:.1f}\n",
            dice.draw(0.2, 1) * radius, dice.draw(12, 24) * radius);
    text += "[[anatomy.target]]\nname = \"end\"\nbranch = \"side0\"\nat_mm = 20\n";
    return text +
           fmt::format("[entry]\nend = \"main.in\"\ninserted_mm = {:.1f}\n", step * dice.draw(1.2, 2.5));
}

std::string random_tube(Dice& dice) {
    const double radius = dice.magnitude(0.8, 8);
    std::string path = "{run_mm = 80}";
    for (int k = static_cast<int>(dice.draw(0, 7)); k > 0; --k) {
        path +=
            fmt::format(", {{arc_radius_mm = {:.2f}, angle_deg = {:.1f}, axis = [{:.3f}, {:.3f}, {:.3f}]}}",
                        dice.draw(2, 8) * radius, (dice.one_in(2) ? -1 : 1) * dice.draw(10, 150),
                        dice.draw(-1, 1), dice.draw(-1, 1), dice.draw(0.1, 1));
        path += fmt::format(", {{run_mm = {:.1f}}}", dice.draw(1, 40));
    }
    return fmt::format(
        "[tube]\nradius_mm = {:.3f}\naround = 16\nstep_mm = 1.0\npath = [{}]\n[entry]\nend = \"start\"\n"
        "inserted_mm = 60\n",
        radius, path);
}

std::string random_scenario(Dice& dice, std::uint32_t seed) {
    const bool tube = !dice.one_in(3), catheter = dice.one_in(3), microcatheter = catheter && dice.one_in(3);
    const char* wire = microcatheter ? dice.of(std::array{"floppy014", "standard014"})
                                     : dice.of(std::array{"floppy014", "standard014", "v18", "glide035",
                                                          "bentson035", "jwire035", "amplatzSS035"});
    std::string text =
        fmt::format("schema = 1\ntitle = \"random {}\"\nseed = {}\n{}[guidewire]\ndevice = \"{}\"\n", seed,
                    seed, tube ? random_tube(dice) : random_tree(seed % trees), wire);
    std::string chain = fmt::format("[chain]\nsegment_length_mm = {:.2f}\n", dice.draw(0.7, 3));
    // The paper's relaxers know neither friction nor torsion.
    const bool of_segments = dice.one_in(8), smooth = of_segments || dice.one_in(2);
    if (dice.one_in(3)) chain += "adaptive = true\n";
    if (of_segments || dice.one_in(2))
        chain += fmt::format("torsion = \"{}\"\n",
                             of_segments ? "rigid" : dice.of(std::array{"rigid", "compliant", "segments"}));
    if (dice.one_in(2)) text += fmt::format("torsional_rigidity_N_mm2 = {:.1f}\n", dice.magnitude(1, 1000));
    std::string friction = "frictionless = true\n", lumen = friction;
    if (!smooth) {
        const double mu = dice.draw(0, 0.4);
        friction = lumen = fmt::format("friction = {:.3f}\n", mu);
        // By the seed, so that what else it draws stays: half of them also stick, and rub in each other and
        // in valves, by which alone half of those are held.
        if (seed % 2 == 1) {
            friction += fmt::format("static_friction = {:.3f}\nvalve_friction_N = {:.3f}\npinned = {}\n",
                                    1.4 * mu, 0.01 + 0.5 * mu, seed % 4 == 1);
            lumen = friction + fmt::format("inner_friction = {:.3f}\nstatic_inner_friction = {:.3f}\n",
                                           0.5 * mu, 0.8 * mu);
        }
    }
    text += friction;
    if (dice.one_in(3)) text += fmt::format("buckling_force_N = {:.2f}\n", dice.magnitude(0.1, 5));
    if (dice.one_in(3))
        text += fmt::format("curved_length_mm = {:.1f}\ncurved_angle_deg = {:.0f}\n", dice.draw(8, 30),
                            dice.draw(-200, 200));
    text += chain;
    if (microcatheter)
        text += fmt::format("[microcatheter]\ndevice = \"micro17\"\ninserted_mm = {:.1f}\n{}",
                            dice.draw(0, 55), lumen);
    if (catheter)
        text += fmt::format("[catheter]\ndevice = \"{}\"\ninserted_mm = {:.1f}\n{}",
                            dice.of(std::array{"berenstein5f", "cobra5f", "pigtail5f", "vertebral4f"}),
                            dice.draw(0, 50), lumen);
    text += fmt::format("[wall]\nstiffness_N_per_mm = {:.3f}\nmodel = \"{}\"\n", dice.magnitude(1, 200),
                        tube ? dice.of(std::array{"auto", "analytic", "distance-field", "mesh"})
                             : dice.of(std::array{"auto", "distance-field", "mesh"}));
    if (dice.one_in(5)) text += fmt::format("[wall.variation]\nseed = {}\n", seed);
    if (of_segments)
        text += fmt::format("[relaxer]\nkind = \"{}\"\nupdates_per_frame = {:.0f}\n",
                            dice.of(std::array{"segment", "first-order", "geometric", "combined", "konings"}),
                            dice.magnitude(300, 20000));
    text += std::string("[target]\nname = \"end\"\n[c_arm]\npixels = 64\n");
    if (dice.one_in(3))
        text +=
            fmt::format("[motion]\nheart_reach_mm = [{:.1f}, 0, 2]\nbreathing_reach_mm = [0, 1, {:.1f}]\n",
                        dice.draw(0, 5), dice.draw(0, 15));
    return text;
}

std::string random_script(Dice& dice, int frames, const std::vector<std::string>& held_ones,
                          const char* vessel) {
    std::string text;
    double trend = 1;
    for (int frame = 0; frame < frames; ++frame) {
        const auto say = [&](const std::string& command) { text += fmt::format("{} {}\n", frame, command); };
        const std::string held = held_ones[static_cast<std::size_t>(dice.draw(0, double(held_ones.size())))];
        if (frame % 20 == 0) trend = dice.draw(-0.4, 1);
        const double what = dice.draw(0, 1);
        if (what < 0.55) {
            const double length = dice.draw(0.1, 4) * (dice.one_in(10) ? 10 : 1);
            say(fmt::format("{} {}{:.2f} mm", dice.draw(0, 1) < 0.5 + 0.5 * trend ? "advance" : "withdraw",
                            held, length));
        }
        if (what > 0.4 && what < 0.8)
            say(fmt::format("rotate {}{:.1f} deg", held, dice.draw(-40, 40) * (dice.one_in(10) ? 10 : 1)));
        if (dice.one_in(12)) {
            const double command = dice.draw(0, 9);
            if (command < 1)
                say(dice.one_in(2) ? "beam on" : "beam off");
            else if (command < 2)
                say(fmt::format("inject {:.1f} ml at {:.1f} ml/s into {}", dice.draw(0.5, 10),
                                dice.draw(0.5, 20), vessel));
            else if (command < 3)
                say(fmt::format("mode {}", dice.of(std::array{"live", "dsa", "roadmap"})));
            else if (command < 4)
                say(fmt::format("arm lao {:.0f} deg cranial {:.0f} deg", dice.draw(-90, 90),
                                dice.draw(-30, 30)));
            else if (command < 5)
                say(fmt::format("contrast {:.0f} mg/ml", dice.draw(0, 200)));
            else if (command < 6)
                say("mask");
            else if (command < 7)
                say("reference");
            else if (command < 8)
                say(fmt::format("table {:.0f} 0 {:.0f} mm", dice.draw(-50, 50), dice.draw(-50, 50)));
            else if (dice.one_in(4))
                say("reset");
        }
    }
    return text + fmt::format("{} end\n", frames);
}

/// Joints against the triangles of the lumen, whatever kind of wall the wire feels.
class LumenCheck {
public:
    explicit LumenCheck(const anatomy::Anatomy& anatomy)
        : anatomy_(anatomy), lumen_(anatomy::closed_lumen(anatomy)) {}

    /// How much farther outside the lumen, as the vessel has made way, a joint is than its wall reports, at
    /// most [mm].
    double hidden_depth(const physics::Chain& wire, std::span<const physics::WallContact> contacts) const {
        double most = 0;
        for (std::size_t i = 0; i < contacts.size(); ++i) {
            const geometry::Vec3& joint = wire.joints[i];
            // What has left by an open end is outside by right.
            const anatomy::VesselEnd* end = end_near(joint, 3 * wire.grid.segment_length);
            if (end && end->role == anatomy::EndRole::Outlet) break;
            if (end) continue;
            const geometry::Vec3 place = joint - contacts[i].given;
            const double told = std::max(contacts[i].pressed_in(), 0.0), distance = lumen_.distance(place);
            if (distance > told + most && !lumen_.encloses(place)) most = distance - told;
        }
        return most;
    }

private:
    const anatomy::VesselEnd* end_near(const geometry::Vec3& x, double reach) const {
        for (const anatomy::VesselEnd& end : anatomy_.ends)
            if ((x - end.opening.centre).norm() < 2 * end.opening.radius + reach || end.opening.beyond(x) > 0)
                return &end;
        return nullptr;
    }

    const anatomy::Anatomy& anatomy_;
    geometry::MeshQuery lumen_;
};

class Play {
public:
    Play(exercise::Simulation& simulation, const LumenCheck& lumen, const script::CommandScript& script,
         StateOutcome& outcome)
        : simulation_(simulation), lumen_(lumen), script_(script), outcome_(outcome) {}

    /// Frames first … last − 1; stops where something does not hold.
    void frames(int first, int last) {
        Rest before = rest({});
        for (int frame = first; frame < last && outcome_.broken.empty(); ++frame) {
            for (const script::TimedCommand& timed : script_.at(frame)) {
                try {
                    simulation_.apply(timed.command);
                } catch (const io::InputError&) {
                    // An injection beyond the limit, an exchange with the wire in.
                }
            }
            const exercise::StepReport report = simulation_.step();
            ++outcome_.frames;
            const Rest after = rest(report);
            judge(frame, before, after, report);
            before = after;
        }
    }

private:
    /// What hands and wire exchange, of the wire shown.
    struct Rest {
        std::vector<physics::WallContact> contacts;
        double energy = 0;                     // [N mm]
        std::vector<physics::HubLoad> loads;   // of each device
        std::vector<double> inserted, turned;  // of each: inside [mm], Σ angle of its hub [rad]
        bool known = false;                    // loads
    };
    Rest rest(const exercise::StepReport& report) const {
        const physics::Chain& wire = simulation_.wire();
        Rest r;
        r.contacts = physics::all_contacts(wire, simulation_.wall());
        r.energy = physics::total_energy(wire, r.contacts).total();
        r.known = report.relax.at_rest() && !report.settling;
        r.loads = physics::hub_loads(wire, r.contacts);
        for (std::size_t k = 0; k < wire.devices.size(); ++k) {
            r.inserted.push_back(wire.devices[k].inserted);
            r.turned.push_back(simulation_.readings().hands[k].turned);
        }
        return r;
    }
    void break_at(int frame, const std::string& what) {
        outcome_.broken = fmt::format("frame {}: {}", frame, what);
    }

    void judge(int frame, const Rest& before, const Rest& after, const exercise::StepReport& report) {
        const physics::Chain& wire = simulation_.wire();
        if (const std::vector<std::string> wrong = physics::validate(wire); !wrong.empty())
            return break_at(frame, wrong.front());
        if (!simulation_.tip().allFinite()) return break_at(frame, "the tip is not finite");
        if (!std::isfinite(after.energy)) return break_at(frame, "the energy is not finite");
        for (const physics::HubLoad& load : after.loads)
            if (!std::isfinite(load.push) || !std::isfinite(load.torque))
                return break_at(frame, "the hand's force is not finite");
        judge_work(frame, before, after, report);
        // The paper's relaxers end where their updates do, however deep the wire is then.
        if (simulation_.scenario().relaxer.kind != physics::RelaxerKind::Global) return;
        if (const double gradient = physics::relative_gradient(wire, after.contacts);
            after.known && wire.grips.empty() && simulation_.wall().smooth() &&
            gradient > 2 * report.relax.gradient + 1e-7)
            break_at(frame, fmt::format("at rest with a gradient of {:g}, and {:g} was reported", gradient,
                                        report.relax.gradient));
        for (const physics::WallContact& contact : after.contacts)
            if (!(contact.pressed_in() <= contact.clearance + 1))
                return break_at(frame, fmt::format("a joint is {:g} mm in the wall of a vessel of {:g} mm",
                                                   contact.penetration, contact.clearance));
        // A random tube may cross itself, where its triangles have no inside.
        if (frame % 5 == 0 && !simulation_.scenario().tube)
            if (const double hidden = lumen_.hidden_depth(wire, after.contacts); hidden > most_hidden)
                break_at(frame,
                         fmt::format("a joint is {:g} mm farther outside the lumen than its wall reports",
                                     hidden));
    }

    /// Without friction the energy rises by no more than the hands have put in. Planes jump where they are
    /// asked anew.
    void judge_work(int frame, const Rest& before, const Rest& after, const exercise::StepReport& report) {
        const scenario::Scenario& s = simulation_.scenario();
        const physics::Chain& wire = simulation_.wire();
        if (wire.has_friction() || s.relaxer.kind != physics::RelaxerKind::Global || report.reset ||
            report.settling || !before.known || !after.known || !simulation_.wall().smooth())
            return;
        // In several parts the force may have been larger on the way than at either end.
        if (report.insertions.size() > 1 || report.rotation > physics::Hub::largest_turn) return;
        const auto more = [](double by, double one, double other) {
            return std::max({by * one, by * other, 0.0});
        };
        double work = 0;
        for (std::size_t k = 0; k < after.loads.size(); ++k)
            work += more(after.inserted[k] - before.inserted[k], before.loads[k].push, after.loads[k].push) +
                    more(after.turned[k] - before.turned[k], before.loads[k].torque, after.loads[k].torque);
        // A joint that comes or goes changes the energy of the same curve a little: two that went, between
        // them and a wall that makes way, by 0.022 N·mm (found case 343).
        const bool still = report.insertions.empty() && report.rotation == 0 &&
                           before.contacts.size() == after.contacts.size();
        const double excess = after.energy - before.energy - work,
                     allowed = still ? 1e-3 * before.energy + 1e-5 : most_excess * before.energy + 0.03;
        if (excess > allowed)
            break_at(frame,
                     fmt::format("the energy rose from {:g} to {:g} N mm, and the hands put in {:g} N mm",
                                 before.energy, after.energy, work));
    }

    static constexpr double most_hidden = 0.3;   // [mm]
    static constexpr double most_excess = 0.05;  // of the energy

    exercise::Simulation& simulation_;
    const LumenCheck& lumen_;
    const script::CommandScript& script_;
    StateOutcome& outcome_;
};

/// Trees are grown once a process.
const anatomy::ModelCache& cache() {
    static const io::ScratchFolder scratch;
    static const anatomy::ModelCache kept{scratch.path() / "cache", {}};
    return kept;
}

}  // namespace

StateCase random_case(std::uint32_t seed, int frames) {
    Dice dice(seed);
    StateCase made{seed, random_scenario(dice, seed), {}, frames};
    const auto has = [&](const char* section) { return made.scenario.find(section) != std::string::npos; };
    std::vector<std::string> held = {""};
    for (const char* other : {"microcatheter", "catheter"})
        if (has(other)) held.push_back(std::string(other) + " ");
    if (held.size() > 1) held.push_back("all ");
    made.script = random_script(dice, frames, held, has("[tube]") ? "tube" : "main");
    return made;
}

StateOutcome play(const StateCase& played, const anatomy::ModelCache* kept) {
    StateOutcome outcome;
    std::optional<exercise::Simulation> simulation;
    script::CommandScript script;
    try {
        const scenario::Scenario scenario = scenario::parse_scenario(
            played.scenario, fmt::format("random{}.toml", played.seed), SELDINGER_SOURCE "/assets/devices");
        script = script::parse_commands(played.script, fmt::format("random{}.gw", played.seed));
        simulation.emplace(scenario, kept ? *kept : cache());
    } catch (const io::InputError& error) {
        outcome.refused = error.what();
        if (outcome.refused.empty()) outcome.broken = "a refusal without a word";
        return outcome;
    }
    const LumenCheck lumen(simulation->anatomy());
    const int middle = played.frames / 2;
    Play first(*simulation, lumen, script, outcome);
    first.frames(0, middle);
    const std::vector<std::byte> state = geometry::state_of(*simulation);
    first.frames(middle, played.frames);
    if (!outcome.broken.empty()) return outcome;
    const std::uint64_t end = simulation->state_hash();
    geometry::restore_state(*simulation, state);
    Play(*simulation, lumen, script, outcome).frames(middle, played.frames);
    if (outcome.broken.empty() && simulation->state_hash() != end)
        outcome.broken = fmt::format("restored at frame {}, it ended in another state: {} instead of {}",
                                     middle, io::hash_text(simulation->state_hash()), io::hash_text(end));
    return outcome;
}

HandOutcome play_hand(exercise::Simulation simulation, std::uint64_t seed) {
    constexpr int speeds = 15, pulls = 60, longest = 15;
    static const room::KeyMap keys = room::load_keys(SELDINGER_SOURCE "/assets/keys.toml");
    Dice dice(static_cast<std::uint32_t>(seed));
    const double frame = 1 / simulation.scenario().frame_rate;
    const auto speed = [&] {  // a frame [mm]
        const auto& keyed = keys.speeds.advance;
        const double least = keyed.front(), most = keyed.back();
        return frame * least * std::pow(most / least, std::floor(dice.draw(0, speeds)) / (speeds - 1));
    };
    const double in = speed(), out = speed(), phase = dice.draw(0, 2);
    const double turning = dice.one_in(2) ? 0
                                          : (dice.one_in(2) ? -1 : 1) * frame *
                                                keys.speeds.rotate[static_cast<std::size_t>(dice.draw(0, 3))];
    const int turned = static_cast<int>(dice.draw(0, 40));
    const bool turns_first = dice.one_in(2);
    const int pushes = std::min(200, static_cast<int>(dice.draw(20, 300) / (2 * in)));
    constexpr std::array each = {script::DeviceRole::Wire, script::DeviceRole::Catheter,
                                 script::DeviceRole::All};
    const script::DeviceRole held = simulation.devices().size() > 1
                                        ? each[static_cast<std::size_t>(dice.draw(0, 3))]
                                        : script::DeviceRole::Wire;

    HandOutcome outcome;
    int settling = 0;
    bool all_out = false;
    const auto inside = [&] {
        return simulation.inserted(held == script::DeviceRole::Catheter ? held : script::DeviceRole::Wire);
    };
    const auto step = [&] {
        const exercise::StepReport report = simulation.step();
        settling = report.settling ? settling + 1 : 0;
        outcome.longest_settling = std::max(outcome.longest_settling, settling);
        outcome.most_updates = std::max(outcome.most_updates, report.relax.updates);
        all_out = all_out || report.withdrawal_stopped || inside() <= 0;
        if (report.settling || !report.relax.at_rest()) return;
        const physics::Chain& wire = simulation.wire();
        const auto push = [&](double by, int device) {
            outcome.most_push = std::max(outcome.most_push, by / simulation.passes_on(device));
        };
        const auto loads = physics::hub_loads(wire, simulation.contacts());
        for (std::size_t k = 0; k < loads.size(); ++k) push(loads[k].push, static_cast<int>(k));
    };
    simulation.apply(script::Advance{phase, held});
    step();
    for (int k = 0; turns_first && turning != 0 && k < turned; ++k) {
        simulation.apply(script::Rotate{turning, held});
        step();
    }
    for (int k = 0; k < pushes; ++k) {
        simulation.apply(script::Advance{in, held});
        if (!turns_first && turning != 0 && k < turned) simulation.apply(script::Rotate{turning, held});
        step();
    }
    const double start = inside();
    for (int k = 0; k < pulls; ++k) {
        simulation.apply(script::Withdraw{out, held});
        step();
    }
    outcome.pulled = pulls * out;
    outcome.brought_back = start - inside();
    const int budget = simulation.scenario().budget.updates;
    if (!all_out && outcome.brought_back < 0.9 * outcome.pulled)
        outcome.broken = fmt::format("{:.1f} mm were pulled and {:.1f} mm came back", outcome.pulled,
                                     outcome.brought_back);
    else if (outcome.longest_settling > longest)
        outcome.broken = fmt::format("{} frames on end show an earlier rest", outcome.longest_settling);
    else if (outcome.most_push > 1 + 1e-9)
        outcome.broken = fmt::format("a push of {:.3f} of what the shaft passes on", outcome.most_push);
    else if (outcome.most_updates > budget)
        outcome.broken = fmt::format("a frame of {} updates; its budget is {}", outcome.most_updates, budget);
    return outcome;
}

int play_hands(int courses, std::uint64_t first,
               const std::function<void(const std::string&, int, const std::string&)>& tell) {
    const auto files = scenario::shipped_scenarios(SELDINGER_SOURCE "/assets/scenarios");
    const int count = static_cast<int>(files.size());
    int broken = 0;
    for (int k = 0; k < count; ++k) {
        const scenario::Scenario scenario =
            scenario::load_scenario(files[static_cast<std::size_t>(k)], SELDINGER_SOURCE "/assets/devices");
        const int some = courses / count + (k < courses % count ? 1 : 0);
        if (some == 0) continue;
        const exercise::Simulation start(scenario, test::cache());
        std::string what;
        for (int c = 0; c < some; ++c) {
            const std::uint64_t seed = first + static_cast<std::uint64_t>(c * count + k);
            const HandOutcome outcome = play_hand(start, seed);
            if (outcome.broken.empty()) continue;
            ++broken;
            what += fmt::format("{}, seed {}: {}\n", scenario.name, seed, outcome.broken);
        }
        tell(scenario.name, some, what);
    }
    return broken;
}

}  // namespace fuzz
