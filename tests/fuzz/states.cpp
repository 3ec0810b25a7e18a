#include "tests/fuzz/states.h"

#include <array>
#include <cmath>
#include <fmt/format.h>
#include <random>
#include <string_view>
#include <vector>

#include "engine/exercise/simulation.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/wire/energy.h"

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

std::string random_scenario(Dice& dice, std::uint32_t seed) {
    const double radius = dice.magnitude(0.8, 8);
    std::string path = "{run_mm = 80}";
    for (int k = static_cast<int>(dice.draw(0, 7)); k > 0; --k) {
        path +=
            fmt::format(", {{arc_radius_mm = {:.2f}, angle_deg = {:.1f}, axis = [{:.3f}, {:.3f}, {:.3f}]}}",
                        dice.draw(2, 8) * radius, (dice.one_in(2) ? -1 : 1) * dice.draw(10, 150),
                        dice.draw(-1, 1), dice.draw(-1, 1), dice.draw(0.1, 1));
        path += fmt::format(", {{run_mm = {:.1f}}}", dice.draw(1, 40));
    }
    std::string text = fmt::format(
        "schema = 1\ntitle = \"random {}\"\nseed = {}\n[tube]\nradius_mm = {:.3f}\naround = 16\nstep_mm = "
        "1.0\n"
        "path = [{}]\n[entry]\nend = \"start\"\ninserted_mm = 60\n[guidewire]\npreset = \"{}\"\n"
        "segment_length_mm = {:.2f}\n",
        seed, seed, radius, path,
        dice.of(std::array{"floppy014", "standard014", "v18", "glide035", "bentson035", "jwire035",
                           "amplatzSS035"}),
        dice.draw(0.7, 3));
    // The paper's relaxers know neither friction nor torsion nor a catheter, and adaptive segments follow one
    // device.
    const bool of_segments = dice.one_in(5), catheter = !of_segments && dice.one_in(3);
    if (!catheter && dice.one_in(3)) text += "adaptive = true\n";
    if (!of_segments && dice.one_in(2)) {
        text += fmt::format("torsional_rigidity_N_mm2 = {:.1f}\n", dice.magnitude(1, 1000));
        if (!catheter && dice.one_in(2))
            text += fmt::format("torsion = \"{}\"\n", dice.of(std::array{"rigid", "compliant", "segments"}));
    }
    if (!of_segments && dice.one_in(2)) text += fmt::format("friction = {:.3f}\n", dice.draw(0, 0.4));
    if (dice.one_in(3)) text += fmt::format("buckling_force_N = {:.2f}\n", dice.magnitude(0.1, 5));
    if (dice.one_in(3))
        text += fmt::format("curved_length_mm = {:.1f}\ncurved_angle_deg = {:.0f}\n", dice.draw(8, 30),
                            dice.draw(-200, 200));
    if (catheter)
        text += fmt::format("[catheter]\ndevice = \"{}\"\ninserted_mm = {:.1f}\n",
                            dice.of(std::array{"berenstein5f", "cobra5f", "pigtail5f", "vertebral4f"}),
                            dice.draw(0, 50));
    text += fmt::format("[wall]\nstiffness_N_per_mm = {:.3f}\nmodel = \"{}\"\n", dice.magnitude(1, 200),
                        dice.of(std::array{"auto", "analytic", "distance-field", "mesh"}));
    if (dice.one_in(5)) text += fmt::format("[wall.variation]\nseed = {}\n", seed);
    if (dice.one_in(4))
        text +=
            fmt::format("[relaxer]\nkind = \"{}\"\nupdates_per_frame = 20000\n",
                        dice.of(std::array{"segment", "first-order", "geometric", "combined", "konings"}));
    text += std::string("[target]\nname = \"end\"\n[c_arm]\npixels = 64\n");
    if (dice.one_in(3))
        text +=
            fmt::format("[motion]\nheart_reach_mm = [{:.1f}, 0, 2]\nbreathing_reach_mm = [0, 1, {:.1f}]\n",
                        dice.draw(0, 5), dice.draw(0, 15));
    return text;
}

std::string random_script(Dice& dice, int frames, bool has_catheter) {
    std::string text;
    double trend = 1;
    for (int frame = 0; frame < frames; ++frame) {
        const auto say = [&](const std::string& command) { text += fmt::format("{} {}\n", frame, command); };
        const std::string held =
            has_catheter && dice.one_in(2) ? dice.of(std::array{"catheter ", "both "}) : std::string();
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
                say(fmt::format("inject {:.1f} ml at {:.1f} ml/s into tube", dice.draw(0.5, 10),
                                dice.draw(0.5, 20)));
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

class Play {
public:
    Play(exercise::Simulation& simulation, const script::CommandScript& script, StateOutcome& outcome)
        : simulation_(simulation), script_(script), outcome_(outcome) {}

    /// Frames first … last − 1; stops where something does not hold.
    void frames(int first, int last) {
        for (int frame = first; frame < last && outcome_.broken.empty(); ++frame) {
            bool moved = false;
            for (const script::TimedCommand& timed : script_.at(frame)) {
                try {
                    simulation_.apply(timed.command);
                    moved = true;
                } catch (const io::InputError&) {
                    // An injection beyond the limit, an exchange with the wire in.
                }
            }
            const double before = energy();
            const exercise::StepReport report = simulation_.step();
            ++outcome_.frames;
            judge(frame, before, moved || was_waiting_, report);
            was_waiting_ = report.waiting_insertion != 0 || report.waiting_rotation != 0 || report.settling ||
                           report.reset;
        }
    }

private:
    double energy() const {
        const physics::Guidewire& wire = simulation_.wire();
        return physics::total_energy(wire, physics::all_contacts(wire, simulation_.wall())).total();
    }
    void break_at(int frame, const std::string& what) {
        outcome_.broken = fmt::format("frame {}: {}", frame, what);
    }

    void judge(int frame, double before, bool hand, const exercise::StepReport& report) {
        if (const std::vector<std::string> wrong = physics::validate(simulation_.wire()); !wrong.empty())
            return break_at(frame, wrong.front());
        if (!simulation_.tip().allFinite()) return break_at(frame, "the tip is not finite");
        const double after = energy();
        if (!std::isfinite(after)) return break_at(frame, "the energy is not finite");
        const scenario::Scenario& s = simulation_.scenario();
        const bool slides =
            s.guidewire.friction == 0 && !s.catheter && s.relaxer.kind == physics::RelaxerKind::Global;
        if (slides && !hand && !report.settling && after > before * (1 + 1e-6) + 1e-6)
            return break_at(frame, fmt::format("no hand moved, and the energy rose from {:g} to {:g} N mm",
                                               before, after));
        const double deepest =
            physics::largest_penetration(physics::all_contacts(simulation_.wire(), simulation_.wall()));
        if (!(deepest <= s.tube->radius + 1))
            return break_at(frame, fmt::format("a joint is {:g} mm in the wall of a vessel of {:g} mm",
                                               deepest, s.tube->radius));
    }

    exercise::Simulation& simulation_;
    const script::CommandScript& script_;
    StateOutcome& outcome_;
    bool was_waiting_ = true;
};

}  // namespace

StateCase random_case(std::uint32_t seed, int frames) {
    Dice dice(seed);
    StateCase made{seed, random_scenario(dice, seed), {}, frames};
    made.script = random_script(dice, frames, made.scenario.find("[catheter]") != std::string::npos);
    return made;
}

StateOutcome play(const StateCase& played) {
    StateOutcome outcome;
    try {
        const scenario::Scenario scenario = scenario::parse_scenario(
            played.scenario, fmt::format("random{}.toml", played.seed), SELDINGER_SOURCE "/assets/devices");
        const script::CommandScript script =
            script::parse_commands(played.script, fmt::format("random{}.gw", played.seed));
        exercise::Simulation simulation(scenario);
        const int middle = played.frames / 2;
        Play first(simulation, script, outcome);
        first.frames(0, middle);
        const std::vector<std::byte> state = geometry::state_of(simulation);
        first.frames(middle, played.frames);
        if (!outcome.broken.empty()) return outcome;
        const std::uint64_t end = simulation.state_hash();
        geometry::restore_state(simulation, state);
        Play(simulation, script, outcome).frames(middle, played.frames);
        if (outcome.broken.empty() && simulation.state_hash() != end)
            outcome.broken = fmt::format("restored at frame {}, it ended in another state: {} instead of {}",
                                         middle, io::hash_text(simulation.state_hash()), io::hash_text(end));
    } catch (const io::InputError& error) {
        outcome.refused = error.what();
        if (outcome.refused.empty()) outcome.broken = "a refusal without a word";
    }
    return outcome;
}

}  // namespace fuzz
