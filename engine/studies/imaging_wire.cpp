#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "render/xray/materials.h"
#include "render/xray/wire_image.h"

namespace studies {
namespace {

using render::Bins;
using render::CArm;
using render::EnergyBins;
using render::Material;

/// A curve in all three dimensions with bends down to a radius of about 10 mm [mm].
Vec3 curve(double s) {
    return {12 * std::sin(s / 13), 14 * std::cos(s / 17) + 3 * std::sin(s / 12), s - 30};
}

/// `count` points of the curve, spaced by an arc length of `step` [mm].
Polyline points_along(int count, double step) {
    constexpr double fine = 1e-3;
    Polyline points{curve(0)};
    Vec3 last = points.front();
    double since = 0;
    for (int k = 1; std::ssize(points) < count; ++k) {
        const Vec3 next = curve(k * fine);
        since += (next - last).norm();
        last = next;
        if (since < step) continue;
        since -= step;
        points.push_back(next);
    }
    return points;
}

/// The wire's shadow by brute force: short cylinders, each cut where its neighbours begin.
class SweptCylinder {
public:
    SweptCylinder(Polyline points, double radius) : points_(std::move(points)), radius_(radius) {
        for (std::size_t i = 0; i < points_.size(); ++i)
            tangents_.push_back(
                (points_[std::min(i + 1, points_.size() - 1)] - points_[i > 0 ? i - 1 : 0]).normalized());
    }

    double chord(const Vec3& origin, const Vec3& ray) const {
        double inside = 0;
        for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
            const Vec3 from = points_[i] - origin, to = points_[i + 1] - origin;
            const double length = (to - from).norm();
            if (from.cross(ray).squaredNorm() > std::pow(2 * radius_ + length, 2)) continue;
            const Vec3 axis = (to - from) / length;
            const double along = ray.dot(axis), offset = from.dot(axis), a = 1 - along * along;
            const double b = from.dot(ray) - offset * along;
            const double c = from.squaredNorm() - offset * offset - radius_ * radius_;
            if (b * b <= a * c) continue;
            double enter = (b - std::sqrt(b * b - a * c)) / a, leave = (b + std::sqrt(b * b - a * c)) / a;
            keep(ray.dot(tangents_[i]), from.dot(tangents_[i]), enter, leave);
            keep(-ray.dot(tangents_[i + 1]), -to.dot(tangents_[i + 1]), enter, leave);
            inside += std::max(0.0, leave - enter);
        }
        return inside;
    }

    const Polyline& points() const { return points_; }

private:
    /// Keeps the part of [enter, leave] where t·rate ≥ level.
    static void keep(double rate, double level, double& enter, double& leave) {
        if (rate > 0) enter = std::max(enter, level / rate);
        if (rate < 0) leave = std::min(leave, level / rate);
    }

    Polyline points_, tangents_;
    double radius_;
};

/// Chords at 8 × 8 places of each pixel near the wire.
struct Supersampled {
    static constexpr int places = 8;
    std::vector<std::uint32_t> pixels;
    std::vector<std::array<float, places * places>> chords;
};

Supersampled supersample(const CArm& arm, const SweptCylinder& wire) {
    Supersampled result;
    std::vector<bool> near(static_cast<std::size_t>(arm.pixels) * arm.pixels);
    for (const Vec3& point : wire.points()) {
        const render::Pixel at = render::project(arm, point);
        for (int y = static_cast<int>(at.y) - 4; y <= static_cast<int>(at.y) + 4; ++y)
            for (int x = static_cast<int>(at.x) - 4; x <= static_cast<int>(at.x) + 4; ++x)
                if (x >= 0 && y >= 0 && x < arm.pixels && y < arm.pixels)
                    near[static_cast<std::size_t>(y) * arm.pixels + x] = true;
    }
    constexpr int n = Supersampled::places;
    const Vec3 origin = render::source(arm);
    for (std::uint32_t pixel = 0; pixel < near.size(); ++pixel) {
        if (!near[pixel]) continue;
        const int x = static_cast<int>(pixel) % arm.pixels, y = static_cast<int>(pixel) / arm.pixels;
        result.pixels.push_back(pixel);
        auto& chords = result.chords.emplace_back();
        for (int k = 0; k < n * n; ++k) {
            const Vec3 ray = render::ray_direction(arm, x + (k % n + 0.5) / n, y + (k / n + 0.5) / n);
            chords[k] = static_cast<float>(wire.chord(origin, ray));
        }
    }
    return result;
}

/// Weights of the bins in the signal that 210 mm of soft tissue leave; their sum is 1.
Bins behind_tissue(const EnergyBins& bins) {
    Bins weights = bins.weights;
    const Bins tissue = bins.attenuation(Material::SoftTissue);
    double sum = 0;
    for (int k = 0; k < render::energy_bins; ++k) sum += weights[k] *= std::exp(-210 * tissue[k]);
    for (double& weight : weights) weight /= sum;
    return weights;
}

struct WireError {
    double square = 0, largest = 0, own = 0, mass = 0;
    int pixels = 0;

    void add(double got, double exact) {
        own += 1 - got;
        mass += 1 - exact;
        if (1 - std::min(got, exact) < 1e-9) return;  // outside the wire
        square += (got - exact) * (got - exact);
        largest = std::max(largest, std::abs(got - exact));
        ++pixels;
    }
    double rms() const { return std::sqrt(square / pixels); }
};

io::Table wire_table(bool quick) {
    io::Table table{
        "imaging_wire",
        {"wire", "pixel_mm", "quanta", "mu_per_mm", "pixels", "rms", "largest", "mass_error_percent"}};
    const int length = quick ? 40 : 120;  // [mm]
    const Polyline joints = points_along(length + 1, 1.0);
    render::WireLook look;
    look.marker_length = 0;
    const SweptCylinder truth(points_along(10 * length + 1, 0.1), 0.5 * look.diameter);
    const EnergyBins bins = render::fit_bins(render::detected_spectrum(imaging_kvp));
    const Bins weights = behind_tissue(bins);
    for (const int pixels : {256, 512}) {
        CArm arm;
        arm.pixels = pixels;
        arm.detector_width = 150;
        arm.lao = 0.4;
        const Supersampled exact = supersample(arm, truth);
        for (const Material material : {Material::Steel, Material::Nitinol, Material::Platinum}) {
            look.body = material;
            const Bins mu = bins.attenuation(material);
            render::WireImage image;
            std::vector<std::array<float, render::energy_bins>> shown(
                static_cast<std::size_t>(pixels) * pixels, {1, 1, 1, 1});
            for (const render::WirePixel& pixel : image.cast(arm, joints, look, {mu, mu}))
                shown[pixel.index] = pixel.transmission;
            std::array<WireError, render::energy_bins> each;
            WireError signal;
            for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
                double got = 0, transmitted = 0;
                for (int k = 0; k < render::energy_bins; ++k) {
                    double transmission = 0;
                    for (const float chord : exact.chords[i])
                        transmission +=
                            std::exp(-mu[k] * chord) / static_cast<double>(exact.chords[i].size());
                    each[k].add(shown[exact.pixels[i]][k], transmission);
                    got += weights[k] * shown[exact.pixels[i]][k];
                    transmitted += weights[k] * transmission;
                }
                signal.add(got, transmitted);
            }
            const auto add = [&](const std::string& quanta, double attenuation, const WireError& error) {
                table.add({render::name_of(material), render::pixel_width(arm), quanta, attenuation,
                           error.pixels, error.rms(), error.largest, 100 * (error.own / error.mass - 1)});
            };
            add("behind 210 mm", std::nan(""), signal);
            for (int k = 0; k < render::energy_bins; ++k)
                add(fmt::format("{:.0f} keV", bins.energies[k]), mu[k], each[k]);
        }
    }
    return table;
}

}  // namespace

StudyResult imaging_wire(const StudyOptions& options) {
    StudyResult result;
    result.tables = {wire_table(options.quick)};
    result.page = filled_text("imaging_wire", {{"table", io::to_markdown(result.tables[0])}});
    return result;
}

}  // namespace studies
