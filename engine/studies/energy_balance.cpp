#include "engine/studies/energy_balance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/anatomy/scenes.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using geometry::degree;
using geometry::Vec3;
using physics::Chain;
using physics::Device;

constexpr int plenty = 100'000'000;  // updates

/// A wire, a micro-catheter and a catheter, each with a curved end.
Device balanced_device(int which, double friction, WindUp windup) {
    struct Kind {
        double outer, inner, tip, shaft;  // [mm], EI [N·mm²]
        std::vector<physics::RestArc> shape;
        double inserted;  // [mm]
    };
    static const std::array<Kind, 3> kinds = {
        Kind{0.889, 0, 6, 250, {{12, 45 * degree, 0}}, 170},
        Kind{1.3, 0.95, 10, 60, {{10, 30 * degree, 0.5}}, 130},
        Kind{1.9, 1.4, 60, 200, {{15, 70 * degree, 0}, {35, -50 * degree, 0}, {40, 40 * degree, 0.3}}, 90}};
    const Kind& kind = kinds[which];
    Device device;
    device.spec.outer_diameter = kind.outer;
    device.spec.inner_diameter = kind.inner;
    device.spec.sections =
        physics::soft_tip(kind.tip, 20, 60, kind.shaft, windup == WindUp::None ? 0 : 0.75 * kind.shaft);
    device.spec.friction = friction;
    device.spec.shape = kind.shape;
    device.inserted = kind.inserted;
    return device;
}

}  // namespace

const char* name_of(WindUp windup) {
    return std::array{"none", "whole", "segments"}[static_cast<std::size_t>(windup)];
}

std::vector<Balance> energy_balances(int devices, double friction, WindUp windup) {
    const physics::TubeWall wall(anatomy::draw(std::vector<anatomy::PenMove>{
                                     anatomy::Run{40}, anatomy::Arc{40, 1.2, Vec3::UnitZ()}, anatomy::Run{30},
                                     anatomy::Arc{35, -1.1, Vec3(0.3, 1, 0).normalized()}, anatomy::Run{90}}),
                                 4, 2.5, 0.4445);
    std::vector<Device> placed = {balanced_device(0, friction, windup)};
    if (devices == 3) placed.push_back(balanced_device(1, friction, windup));
    if (devices > 1) placed.push_back(balanced_device(2, friction, windup));
    physics::Hub hub({}, wall);
    Chain chain = physics::chain_along(placed, {1}, wall.centreline());
    hub.settle(chain, plenty);
    for (int k = 0; k < devices && windup == WindUp::Segments; ++k) physics::start_twists(chain, k);
    physics::start_grips(chain);
    hub.settle(chain, plenty);

    const auto energy = [&] {
        return physics::total_energy(chain, physics::all_contacts(chain, wall)).total();
    };
    std::vector<Balance> found;
    const auto move = [&](int device, const char* motion, double feed, double turn, int steps) {
        Balance b{devices, friction, windup, device, motion};
        double before = energy(), lost = chain.friction_loss;
        physics::HubLoad load = hub.loads()[device];
        for (int k = 0; k < steps; ++k) {
            double left = 1, work = 0;
            for (int tries = 0; left > 1e-9 && tries < 64; ++tries) {
                const auto report =
                    hub.move(chain, {left * feed / steps, left * turn / steps, device}, plenty);
                if (report.outcome != physics::HubReport::Outcome::AtRest) break;
                const physics::HubLoad now = hub.loads()[device];
                work += 0.5 * (load.push + now.push) * report.made.feed +
                        0.5 * (load.torque + now.torque) * report.made.turn;
                load = now;
                left -= feed != 0 ? report.made.feed * steps / feed : report.made.turn * steps / turn;
            }
            b.not_at_rest += left > 1e-9;
            const double after = energy(), gained = after - before, loss = chain.friction_loss - lost;
            before = after, lost = chain.friction_loss;
            b.work += work, b.gained += gained, b.loss += loss;
            b.traffic += std::max(std::abs(work), std::abs(gained) + loss);
            b.missing += std::abs(work - gained - loss);
        }
        found.push_back(b);
    };
    for (int k = 0; k < devices; ++k) {
        move(k, "in", 10, 0, 211);  // whose steps meet no multiple of λ
        move(k, "turned", 0, 40 * degree, 80);
        move(k, "out", -10, 0, 211);
    }
    return found;
}

}  // namespace studies
