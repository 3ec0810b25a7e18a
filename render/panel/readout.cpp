#include "render/panel/readout.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "render/xray/c_arm.h"

namespace render {
namespace {

constexpr const char* dash = "--";

std::string angle_text(double angle, const char* positive, const char* negative) {
    const double degrees = std::round(angle * 180.0 / std::numbers::pi);
    if (!std::isfinite(degrees)) return std::string(positive) + " " + dash;
    return (degrees < 0.0 ? negative : positive) + (" " + figure_text(std::abs(degrees), 0)) + "°";
}

std::string direction_letters(const geometry::Vec3& direction) {
    constexpr const char* positive = "LPH";
    constexpr const char* negative = "RAF";
    int first = 0, second = 1;
    if (std::abs(direction[second]) > std::abs(direction[first])) std::swap(first, second);
    if (std::abs(direction[2]) > std::abs(direction[first])) {
        second = first;
        first = 2;
    } else if (std::abs(direction[2]) > std::abs(direction[second])) {
        second = 2;
    }
    const auto letter = [&](int axis) { return (direction[axis] > 0.0 ? positive : negative)[axis]; };
    std::string letters(1, letter(first));
    constexpr double oblique = 0.26;  // sin 15°
    if (std::abs(direction[second]) > oblique) letters += letter(second);
    return letters;
}

}  // namespace

bool is_known(std::optional<double> value) {
    return value && std::isfinite(*value);
}

std::string figure_text(std::optional<double> value, int decimals) {
    if (!is_known(value)) return dash;
    std::array<char, 64> text{};
    // Above a million no readout has room for every digit.
    const bool large = std::abs(*value) >= 1e6;
    const auto end =
        large ? std::to_chars(text.begin(), text.end(), *value, std::chars_format::scientific, 1)
              : std::to_chars(text.begin(), text.end(), *value, std::chars_format::fixed, decimals);
    std::string result(text.begin(), end.ptr);
    if (result.find_first_of("123456789") == std::string::npos && result.starts_with('-')) result.erase(0, 1);
    return result;
}

std::string dose_text(std::optional<double> value) {
    const double size = value ? std::abs(*value) : 0.0;
    return figure_text(value, size >= 99.95 ? 0 : size >= 9.995 ? 1 : 2);
}

std::string centimetre_text(std::optional<double> length) {
    if (length) *length *= 0.1;
    return figure_text(length, 0);
}

std::string rate_text(std::optional<double> rate) {
    return figure_text(rate, rate && *rate == std::round(*rate) ? 0 : 1);
}

std::string primary_angle_text(double lao) {
    return angle_text(lao, "LAO", "RAO");
}
std::string secondary_angle_text(double cranial) {
    return angle_text(cranial, "CRAN", "CAUD");
}

std::string mask_shift_text(double x, double y) {
    if (!(std::max(std::abs(x), std::abs(y)) >= 0.05) || !std::isfinite(x + y)) return "";
    return "mask " + figure_text(std::abs(x), 1) + (x < 0.0 ? " left " : " right ") +
           figure_text(std::abs(y), 1) + (y < 0.0 ? " up" : " down") + " px";
}

std::string inflation_text(const Readout::Balloon& b) {
    if (b.burst) return "burst";
    return figure_text(b.pressure, 1) + " atm (nominal " + figure_text(b.nominal, 0) + ", rated " +
           figure_text(b.rated, 0) + ")";
}

std::string balloon_width_text(const Readout::Balloon& b) {
    constexpr double seen = 0.1;  // [mm]
    const std::string width = figure_text(b.diameter, 1) + " mm";
    if (!is_known(b.diameter) || !is_known(b.waist) || *b.diameter - *b.waist < seen) return width;
    return width + ", waist " + figure_text(b.waist, 1) + " mm";
}

std::string stent_text(const Readout::Balloon& b) {
    if (is_known(b.out))
        return figure_text(b.out, 0) + " of " + figure_text(b.stent, 0) + " mm out of its sheath";
    return b.deployed ? "has left its balloon" : figure_text(b.stent, 0) + " mm, on its balloon";
}

std::string pressure_text(const Readout& r) {
    if (!is_known(r.systolic) || !is_known(r.diastolic) || !is_known(r.mean_pressure)) return dash;
    return figure_text(r.systolic, 0) + "/" + figure_text(r.diastolic, 0) + " (" +
           figure_text(r.mean_pressure, 0) + ")";
}

double pressure_scale(const Readout& r) {
    double highest = 150;
    for (const double pressure : r.pressure_history)
        if (std::isfinite(pressure)) highest = std::max(highest, pressure);
    return highest;
}

std::string clock_text(std::optional<double> time) {
    if (!time || !(*time >= 0.0 && *time < 1e6)) return dash;
    const auto seconds = static_cast<long>(*time);
    const auto two = [](long n) { return (n < 10 ? "0" : "") + std::to_string(n); };
    const std::string rest = ":" + two(seconds % 60);
    if (seconds < 3600) return std::to_string(seconds / 60) + rest;
    return std::to_string(seconds / 3600) + ":" + two(seconds / 60 % 60) + rest;
}

ImageSides image_sides(double lao, double cranial) {
    if (!std::isfinite(lao) || !std::isfinite(cranial)) return {};
    CArm arm;
    arm.lao = lao;
    arm.cranial = cranial;
    const ArmAxes a = axes(arm);
    return {direction_letters(-a.right), direction_letters(a.right), direction_letters(a.up)};
}

}  // namespace render
