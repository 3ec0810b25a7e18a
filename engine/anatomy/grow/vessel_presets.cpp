#include "engine/anatomy/grow/vessel_presets.h"

#include <array>

#include "engine/anatomy/grow/preset_builders.h"
#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

constexpr int most_rejected = 100;

struct Known {
    VesselPreset preset;
    VesselTreeSpec (*build)(Variation&);
};

// The type of an arch depends on how far the trunk's origin lies below its top: under 1, 1 to 2, over 2
// diameters.
template <int tenths, int lowest, int highest, bool bovine = false, bool arms = false>
VesselTreeSpec arch_of(Variation& v) {
    return arch(v, {tenths / 10.0, lowest / 10.0, highest / 10.0, bovine, arms});
}

const std::array<Known, 13> known = {{
    {{"arch-1", "aortic arch of type I to both carotid arteries"}, arch_of<5, 1, 9>},
    {{"arch-2", "aortic arch of type II"}, arch_of<15, 11, 19>},
    {{"arch-3", "aortic arch of type III"}, arch_of<25, 21, 30>},
    {{"arch-bovine", "left carotid off the brachiocephalic trunk"}, arch_of<5, 1, 9, true>},
    {{"arch-arms", "aortic arch with both arms, from the radial arteries"}, arch_of<5, 1, 9, false, true>},
    {{"aorta", "from both groins to the arch and the carotid arteries"}, whole_aorta},
    {{"arch-lca", "aortic arch with the left coronary artery"}, arch_with_coronary},
    {{"lca", "left coronary artery"}, left_coronary},
    {{"rca", "right coronary artery"}, right_coronary},
    {{"iliac-renal", "from both groins to the visceral arteries"}, iliac_renal},
    {{"femoral", "from the right groin over the aortic bifurcation to the left thigh"}, femoral},
    {{"cerebral", "internal carotid to the middle and anterior cerebral arteries"}, cerebral},
    {{"circle", "both internal carotids and vertebrals, basilar artery and circle of Willis"},
     circle_of_willis},
}};

}  // namespace

std::span<const VesselPreset> vessel_presets() {
    static const auto list = [] {
        std::array<VesselPreset, known.size()> result;
        for (std::size_t i = 0; i < known.size(); ++i) result[i] = known[i].preset;
        return result;
    }();
    return list;
}

DrawnVessels draw_vessels(std::string_view name, std::uint64_t seed, const PatientWish& wish) {
    std::vector<std::string_view> names;
    for (const Known& one : known) {
        names.push_back(one.preset.name);
        if (one.preset.name != name) continue;
        const Draws draws(seed);
        const Patient patient = drawn_patient(draws, wish);
        // Some draws run into themselves; then the next one is taken.
        for (int attempt = 0;; ++attempt) {
            try {
                Variation variation(patient, draws, static_cast<std::uint64_t>(attempt));
                VesselTreeSpec spec = one.build(variation);
                spec.name = name;
                spec.patient = patient;
                grow(spec);
                return {std::move(spec), attempt};
            } catch (const io::InputError&) {
                if (!draws.varied() || attempt == most_rejected) throw;
            }
        }
    }
    throw io::InputError("'{}' is not a preset{}; presets are: {}", name, io::suggestion(name, names),
                         io::joined(names));
}

VesselTreeSpec vessel_preset(std::string_view name, std::uint64_t seed, const PatientWish& wish) {
    return draw_vessels(name, seed, wish).spec;
}

}  // namespace anatomy
