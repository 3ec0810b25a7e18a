#include "engine/scenario/device_treatment.h"

#include <algorithm>
#include <fmt/format.h>
#include <optional>
#include <string_view>
#include <toml++/toml.h>

namespace scenario {
namespace {

constexpr io::Range pressures{0.1, 60}, diameters{0.3, 60};  // [atm], [mm]

/// A section all of whose keys must be there, each with a source.
class TreatmentValues {
public:
    TreatmentValues(io::Section& section, std::string name, std::vector<std::string>& given)
        : section_(section), name_(std::move(name)), given_(given) {}

    const toml::node* find(const char* key) {
        const toml::node* node = section_.find(key);
        if (node)
            given_.push_back(name_ + "." + key);
        else
            section_.missing(key, fmt::format("{} = ... in [{}]", key, name_));
        return node;
    }
    void number(const char* key, double& value, io::Range range, double unit = 1) {
        find(key);
        section_.number(key, value, range, unit);
    }
    /// One that the device must not have.
    void none(const char* key, const char* why) {
        if (const toml::node* node = section_.find(key))
            refuse(key, *node, fmt::format("expected none {}", why));
    }
    void refuse(const char* key, const toml::node& node, const std::string& accepted) {
        section_.refuse(key, node, accepted);
    }
    /// Refuses the value of a key that is there.
    void expect(bool fine, const char* key, const std::string& accepted) {
        const toml::node* node = section_.find(key);
        if (node && !fine) refuse(key, *node, accepted);
    }
    io::Section& section() { return section_; }

private:
    io::Section& section_;
    std::string name_;
    std::vector<std::string>& given_;
};

std::optional<physics::BalloonLaw::Row> row_of(const toml::node& node) {
    const toml::array* pair = node.as_array();
    if (!pair || pair->size() != 2 || !(*pair)[0].is_number() || !(*pair)[1].is_number()) return std::nullopt;
    const physics::BalloonLaw::Row row{*(*pair)[0].value<double>(), *(*pair)[1].value<double>()};
    const auto within = [](double x, io::Range range) { return x >= range.least && x <= range.most; };
    return within(row.pressure, pressures) && within(row.diameter, diameters) ? std::optional(row)
                                                                              : std::nullopt;
}

/// Empty where the table is refused.
std::vector<physics::BalloonLaw::Row> read_compliance(TreatmentValues& values) {
    constexpr const char* key = "compliance";
    const toml::node* node = values.find(key);
    if (!node) return {};
    std::vector<physics::BalloonLaw::Row> rows;
    const toml::array* list = node->as_array();
    for (std::size_t k = 0; list && k < list->size(); ++k) {
        const auto row = row_of((*list)[k]);
        if (!row) {
            values.refuse(key, (*list)[k],
                          fmt::format("expected a row [atm, mm], a pressure from {} and a diameter from {}",
                                      pressures.text(), diameters.text()));
            return {};
        }
        if (!rows.empty() &&
            !(row->pressure > rows.back().pressure && row->diameter > rows.back().diameter)) {
            values.refuse(key, (*list)[k],
                          fmt::format("expected more than the {:g} atm and the {:g} mm of the row before",
                                      rows.back().pressure, rows.back().diameter));
            return {};
        }
        rows.push_back(*row);
    }
    if (rows.size() < 2) {
        values.refuse(key, *node, "expected at least two rows, [[atm, mm], [atm, mm], …]");
        return {};
    }
    return rows;
}

Balloon read_balloon(TreatmentValues values, const Device& d) {
    Balloon b;
    values.number("length_mm", b.length, {3, 300});
    values.number("cone_mm", b.cone, {0.5, 40});
    values.number("from_tip_mm", b.from_tip, {0, 200});
    values.number("profile_mm", b.law.profile, {0.3, physics::DeviceLimits::diameter});
    values.number("nominal_atm", b.nominal, pressures);
    values.number("rated_atm", b.rated, pressures);
    values.number("deflation_s", b.deflation, {0.1, 120});
    values.number("inflated_rigidity_N_mm2", b.rigidity, {0, physics::DeviceLimits::rigidity});
    b.law.table = read_compliance(values);
    values.expect(b.from_tip >= b.cone, "from_tip_mm",
                  fmt::format("expected at least the {:g} mm of the cone distal of it", b.cone));
    const double whole = b.from_tip + b.length + b.cone;
    values.expect(
        whole <= d.length, "length_mm",
        fmt::format("expected a balloon within the device's {:g} mm, found one to {:g} mm from its tip",
                    d.length, whole));
    values.expect(
        b.law.profile >= d.outer_diameter, "profile_mm",
        fmt::format("expected at least the {:g} mm of the shaft, outer_diameter_mm", d.outer_diameter));
    values.expect(b.rated >= b.nominal, "rated_atm",
                  fmt::format("expected at least the nominal {:g} atm", b.nominal));
    if (b.law.table.size() < 2) return b;
    const physics::BalloonLaw::Row &first = b.law.table.front(), &last = b.law.table.back();
    const std::string within =
        fmt::format("expected a pressure within the table, {:g} to {:g} atm", first.pressure, last.pressure);
    values.expect(b.nominal >= first.pressure && b.nominal <= last.pressure, "nominal_atm", within);
    values.expect(b.rated >= first.pressure && b.rated <= last.pressure, "rated_atm", within);
    const double unfolded = b.law.diameter(std::min(physics::BalloonLaw::unfolds_at, first.pressure));
    values.expect(b.law.profile < unfolded, "profile_mm",
                  fmt::format("expected less than the {:.3g} mm that the table gives it when it has unfolded",
                              unfolded));
    return b;
}

Stent read_stent(TreatmentValues values) {
    Stent s;
    if (values.find("self_expanding")) values.section().flag("self_expanding", s.law.self_expanding);
    values.number("length_mm", s.length, {3, 300});
    values.number("diameter_mm", s.diameter, diameters);
    values.number("largest_diameter_mm", s.law.free_radius, diameters, 0.5);
    values.number("foreshortening", s.foreshortening, {0, 0.6});
    values.number("radial_strength_atm", s.law.strength, {0.01, 20});
    if (s.law.self_expanding) {
        values.number("outward_atm", s.law.outward, {0.01, 20});
        values.expect(
            s.law.outward <= s.law.strength, "outward_atm",
            fmt::format("expected up to the {:g} atm that it bears, radial_strength_atm", s.law.strength));
        values.none("recoil", "of a stent that expands by itself");
        values.none("opens_at_atm", "of a stent that expands by itself");
    } else {
        values.number("recoil", s.law.recoil, {0, 0.3});
        values.number("opens_at_atm", s.law.opens_at, pressures);
        values.none("outward_atm", "of a stent that a balloon expands");
    }
    values.number("from_tip_mm", s.from_tip, {0, 200});
    values.number("strut_mm", s.strut, {0.02, 0.5});
    if (values.find("crowns")) values.section().whole("crowns", s.crowns, {3, 48});
    values.number("pitch_mm", s.pitch, {0.3, 30});
    std::vector<std::string_view> names;
    for (int k = 0; k < render::material_count; ++k)
        names.push_back(render::name_of(static_cast<render::Material>(k)));
    if (values.find("material"))
        if (const auto which = values.section().choice("material", names))
            s.material = static_cast<render::Material>(*which);
    values.expect(2 * s.law.free_radius >= s.diameter, "largest_diameter_mm",
                  fmt::format("expected at least the nominal {:g} mm, diameter_mm", s.diameter));
    values.expect(s.pitch <= s.length, "pitch_mm",
                  fmt::format("expected up to the stent's {:g} mm", s.length));
    return s;
}

/// Whether the crimped stent lies on the balloon, its cones included.
void check_mounted(io::Section& section, const Balloon& b, const Stent& s) {
    const double crimped = s.length / (1 - s.foreshortening), slack = b.cone + 1e-9;
    if (s.from_tip < b.from_tip - slack || s.from_tip + crimped > b.from_tip + b.length + slack)
        section.refuse_whole(fmt::format(
            "a crimped stent from {:g} to {:g} mm from the tip; expected one on the balloon, {:g} to {:g} mm",
            s.from_tip, s.from_tip + crimped, b.from_tip, b.from_tip + b.length));
}

}  // namespace

void read_treatment(io::Section& top, Device& d, std::vector<std::string>& given) {
    io::Section balloon = top.section("balloon", false), stent = top.section("stent", false);
    if (d.kind == DeviceKind::Stent) {
        if (stent.given())
            d.stent = read_stent({stent, "stent", given});
        else
            top.missing("stent", "section [stent]");
        stent.finish();
    } else if (stent.given()) {
        stent.refuse_whole(fmt::format("a {} with a [stent]; expected kind = \"stent\"", name_of(d.kind)));
    }
    const bool opened = d.stent && !d.stent->law.self_expanding;
    if (d.kind == DeviceKind::Balloon || opened) {
        if (balloon.given())
            d.balloon = read_balloon({balloon, "balloon", given}, d);
        else
            top.missing("balloon",
                        opened ? "section [balloon], which opens the stent," : "section [balloon]");
        balloon.finish();
    } else if (balloon.given()) {
        balloon.refuse_whole(fmt::format(
            "a {} with a [balloon]; expected kind = \"balloon\", or a stent of self_expanding = false",
            name_of(d.kind)));
    }
    if (d.balloon && d.stent) check_mounted(stent, *d.balloon, *d.stent);
    if (d.stent && d.stent->from_tip + d.stent->length > d.length)
        stent.refuse_whole(
            fmt::format("a stent to {:g} mm from the tip of a device of {:g} mm; expected one on it",
                        d.stent->from_tip + d.stent->length, d.length));
    if (const toml::node* node = top.find("wire_lumen_mm"); node && d.wire_lumen > d.length)
        top.refuse("wire_lumen_mm", *node, fmt::format("expected up to the device's {:g} mm", d.length));
}

}  // namespace scenario
