/// The table of the energy balance: one to three devices, with and without friction, shafts that are rigid,
/// that wind up as a whole, and that twist segment by segment.

#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>

#include "engine/anatomy/scenes.h"
#include "physics/relax/hub.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace physics {
namespace {

constexpr int work_enough = 1'000'000'000;
/// Of the mean work of a step, and of every step: where a contact is made or a grip begins to slip within
/// one, the mean of the loads before and after errs by an eighth of the jump of the load's slope times the
/// step squared. That is up to 2.6 % of a step of 0.05 mm, and falls with the step.
constexpr double fraction = 0.01;
enum class Shaft { Rigid, Whole, Segments };

struct Case {
    int devices = 1;
    double friction = 0;
    Shaft shaft = Shaft::Rigid;
};

/// A guidewire, a cobra catheter and a guiding sheath.
std::vector<Device> devices_of(const Case& c) {
    const double gj = c.shaft == Shaft::Rigid ? 0 : 150;
    std::vector<Device> devices(c.devices);
    DeviceSpec& wire = devices[0].spec;
    wire.sections = soft_tip(6, 30, 60, 150, gj);
    wire.shape = {{12, 45 * degree, 0}};
    devices[0].inserted = 110.3;
    if (c.devices > 1) {
        DeviceSpec& catheter = devices[1].spec;
        catheter.outer_diameter = 1.67, catheter.inner_diameter = 1.1;
        catheter.sections = soft_tip(60, 20, 30, 200, gj);
        catheter.shape = {{15, 60 * degree, 0}, {25, -40 * degree, 0.4}};
        devices[1].inserted = 80.7;
        devices[1].roll = 1.2;
    }
    if (c.devices > 2) {
        DeviceSpec& sheath = devices[2].spec;
        sheath.outer_diameter = 2.4, sheath.inner_diameter = 1.9;
        sheath.sections = soft_tip(200, 15, 15, 400, 4 * gj);
        sheath.shape = {{20, 20 * degree, 0}};
        devices[2].inserted = 52.9;
        devices[2].roll = -0.7;
    }
    for (Device& device : devices) device.spec.friction = c.friction;
    return devices;
}

/// Of the steps of one motion.
struct Balance {
    double missing = 0, worst = 0, work = 0;  // Σ|ΔE + loss − work|, the largest, Σ|work| [N·mm]
    int steps = 0;

    double mean_fraction() const { return missing / work; }
    double worst_fraction() const { return worst * steps / work; }
};

class BalanceOf {
public:
    explicit BalanceOf(const Case& c) : line_(vessel()), wall_(line_, 4, 20, 0.44), hub_({}, wall_) {
        chain_ = chain_along(devices_of(c), {2, EndCells::Half}, line_);
        hub_.settle(chain_, work_enough);
        if (c.shaft == Shaft::Segments)
            for (int k = 0; k < c.devices; ++k) start_twists(chain_, k);
        start_grips(chain_);
        hub_.settle(chain_, work_enough);
    }
    /// After a run-up that lets the grips slip as they will, and no further.
    Balance of(const HubMotion& step) {
        for (int k = 0; k < 4; ++k) moved(step);
        Balance balance;
        for (int k = 0; k < 10; ++k) {
            const HubLoad before = hub_.loads()[step.device];
            const double energy = this->energy();
            const HubMotion made = moved(step);
            const HubLoad after = hub_.loads()[step.device];
            const double work =
                0.5 * ((before.push + after.push) * made.feed + (before.torque + after.torque) * made.turn);
            const double missing = std::abs(this->energy() - energy - work);
            balance.missing += missing;
            balance.worst = std::max(balance.worst, missing);
            balance.work += std::abs(work);
            ++balance.steps;
        }
        return balance;
    }

private:
    static Polyline vessel() {
        using anatomy::Arc, anatomy::Run;
        return anatomy::draw(std::vector<anatomy::PenMove>{Run{30}, Arc{40, 1.2, Vec3::UnitZ()}, Run{10},
                                                           Arc{30, -1.3, Vec3::UnitY()}, Run{120}});
    }
    double energy() const {
        return total_energy(chain_, all_contacts(chain_, wall_)).total() + chain_.friction_loss;
    }
    HubMotion moved(const HubMotion& step) {
        const HubReport report = hub_.move(chain_, step, work_enough);
        EXPECT_EQ(report.outcome, HubReport::Outcome::AtRest);
        EXPECT_TRUE(validate(chain_).empty());
        return report.made;
    }

    Polyline line_;
    TubeWall wall_;
    Hub hub_;
    Chain chain_;
};

}  // namespace

TEST(Balance, TheHandsWorkIsTheGainOfEnergyAndTheLossByFriction) {
    const char* shafts[] = {"rigid", "whole", "segments"};
    std::printf("devices friction shaft    device motion  |work| [N·mm]  missing   worst step\n");
    for (const int devices : {1, 2, 3})
        for (const double friction : {0.0, 0.1})
            for (const Shaft shaft : {Shaft::Rigid, Shaft::Whole, Shaft::Segments})
                for (int device = 0; device < devices; ++device) {
                    const Case c{devices, friction, shaft};
                    BalanceOf balance(c);
                    const HubMotion in{0.0125, 0, device}, out{-0.0125, 0, device}, turn{0, 0.02, device};
                    const char* names[] = {"in", "out", "turn"};
                    int motion = 0;
                    for (const HubMotion& step : {in, out, turn}) {
                        const Balance b = balance.of(step);
                        std::printf("%d       %.1f      %-8s %d      %-6s  %9.4f      %6.3f %%  %6.3f %%\n",
                                    devices, friction, shafts[static_cast<int>(shaft)], device,
                                    names[motion++], b.work, 100 * b.mean_fraction(),
                                    100 * b.worst_fraction());
                        EXPECT_LE(b.worst_fraction(), fraction);
                    }
                }
}

}  // namespace physics
