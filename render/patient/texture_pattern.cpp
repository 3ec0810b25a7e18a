#include "render/patient/texture_pattern.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "physics/geometry/maths.h"
#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

using geometry::BitModel;
using geometry::NumberModel;
using geometry::Random;
using geometry::RangeCoder;

constexpr int most_tries = 31;  // of a triangle

// Of tissue. Half-axes r of smallest to largest. A blob's image has an energy ∝ fraction² · r⁴ at frequencies
// about 1/(4r). With n(r) d(ln r) ∝ r^(−7/3) and the larger the fainter, fraction ∝ (smallest/r)^0.7, the
// power of the sum is ∝ f^(−2.4), somewhat steeper where the smallest end.
constexpr double smallest = 1.0, largest = 24.0, longest = 2.4;  // longest: times r, along the axis
constexpr double filled = 0.030;  // of the place, by the blobs of each factor e of r (estimate)
constexpr double power = 7.0 / 3.0;
// Of grain.
constexpr double finest = 0.5, grain_power = 1.7;

Vec3 three(const TexturePattern& p, std::size_t from) {
    return {p.numbers[from], p.numbers[from + 1], p.numbers[from + 2]};
}

double rarest_tissue() {
    return geometry::pow(smallest / largest, power);
}
double tissue_tries(const Vec3& size) {
    constexpr double mean_volume =
        std::numbers::pi * std::numbers::pi / 8.0 * 0.5 * (1.0 + longest) * smallest * smallest * smallest;
    return filled / mean_volume * (1.0 - rarest_tissue()) / power * size.prod();
}

/// Calls `keeps(index, try)` for each try in turn.
template <class Keeps>
void each_in_tissue(const TexturePattern& p, Keeps keeps) {
    const Vec3 low = three(p, 0), size = three(p, 3);
    const double rarest = rarest_tissue();
    Random random(p.field);
    const auto count = static_cast<std::size_t>(tissue_tries(size));
    for (std::size_t k = 0; k < count; ++k) {
        const double x = random(), y = random(), z = random();
        TextureTry at{};
        at.middle = low + Vec3(x, y, z).cwiseProduct(size);
        at.radius = smallest * geometry::pow(1.0 - random() * (1.0 - rarest), -1.0 / power);
        at.length = random.between(1.0, longest);
        // Bundles of muscle and lobules of fat run along the body more than across it.
        const double ax = random.between(-1, 1), ay = random.between(-1, 1), az = random.between(-1.6, 1.6);
        at.axis = Vec3(ax, ay, az + (az < 0 ? -1e-6 : 1e-6));
        keeps(k, at);
    }
}

struct Facet {
    Vec3 a, b, c, inward;
    double area = 0.0;
};
Facet facet(const geometry::TriangleMesh& mesh, std::size_t triangle) {
    const auto& t = mesh.triangles[triangle];
    const auto corner = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    Facet facet{corner(0), corner(1), corner(2), Vec3::Zero()};
    const Vec3 normal = (facet.b - facet.a).cross(facet.c - facet.a);
    const double twice = normal.norm();
    if (twice < 1e-9) return facet;
    facet.inward = -normal / twice;
    facet.area = 0.5 * twice;
    return facet;
}

/// On average area · per_area.
int tries(const Facet& facet, double per_area, double chance, double most) {
    const double count = facet.area * per_area + chance;
    return static_cast<int>(count < most ? count : most);
}
Vec3 somewhere_on(const Facet& facet, Random& random) {
    const double u = std::sqrt(random()), v = random();
    return (1.0 - u) * facet.a + u * (1.0 - v) * facet.b + u * v * facet.c;
}

/// Random numbers of a triangle of a pattern, and of each of its tries.
Random numbers_of(const TexturePattern& p, std::size_t triangle, int k) {
    return Random(geometry::mixed(p.field + (triangle * (most_tries + 1) + static_cast<std::size_t>(k)) *
                                                geometry::golden_step));
}
int grain_tries(const TexturePattern& p, const Facet& on, std::size_t triangle) {
    return tries(on, p.numbers[0], numbers_of(p, triangle, most_tries)(), most_tries);
}
TextureTry grain_try(const TexturePattern& p, const Facet& on, std::size_t triangle, int k) {
    const double deepest = p.numbers[1], rarest = geometry::pow(finest / p.numbers[2], grain_power);
    Random random = numbers_of(p, triangle, k);
    TextureTry at{};
    at.depth = random.between(0.5, deepest);
    at.radius = finest * geometry::pow(1.0 - random() * (1.0 - rarest), -1.0 / grain_power);
    at.length = random.between(1.0, 1.5 + 2.5 / at.radius);
    const double ax = random.between(-1, 1), ay = random.between(-1, 1), az = random.between(-1, 1);
    at.axis = Vec3(ax, ay, az + 1e-6);
    const Vec3 along = three(p, 3);
    at.axis += 1.6 * (at.axis.dot(along) < 0.0 ? Vec3(-along) : along);
    at.middle = somewhere_on(on, random) + at.depth * on.inward;
    return at;
}

/// What is more here is less there.
class Balance {
public:
    explicit Balance(double start) : sum_(start) {}
    void add(TextureBlob& blob, double more, double less) {
        blob.fraction = static_cast<float>(sum_ > 0.0 ? less : more);
        sum_ += content(blob);
    }

private:
    double sum_;
};

TextureBlob blob_of(const TextureTry& at, const Vec3& middle) {
    TextureBlob blob;
    blob.middle = middle.cast<float>();
    blob.axis = at.axis.normalized().cast<float>();
    blob.radius = static_cast<float>(at.radius);
    blob.elongation = static_cast<float>(at.length);
    return blob;
}

void require_sound(const TexturePattern& p, const geometry::TriangleMesh& mesh) {
    const bool known = p.kind == TexturePattern::Kind::Tissue || p.kind == TexturePattern::Kind::Grain ||
                       p.kind == TexturePattern::Kind::Plaques;
    bool sound = known && p.from <= p.to && p.to <= mesh.triangles.size() &&
                 std::ranges::all_of(p.numbers, [](double n) { return std::abs(n) < 1e9; });
    if (sound && p.kind == TexturePattern::Kind::Tissue)
        sound = three(p, 0).cwiseAbs().maxCoeff() < 1e4 && three(p, 3).minCoeff() >= 0 &&
                three(p, 3).maxCoeff() < 1e4;
    if (sound && p.kind == TexturePattern::Kind::Grain)
        sound = p.numbers[0] >= 0 && p.numbers[1] < 1e3 && p.numbers[1] >= 0.5 && p.numbers[2] >= finest;
    if (!sound) throw std::runtime_error("the texture of the body is damaged");
}

/// Which bits are known, by what was kept near a place: most tries are far from the border.
class Neighbourhood {
public:
    Neighbourhood(const Vec3& low, const Vec3& size) : low_(low) {
        for (int k = 0; k < 3; ++k) size_[k] = 3 + static_cast<std::size_t>(size[k] / cell);
        if (size_[0] * size_[1] * size_[2] > std::size_t{1} << 24)
            throw std::runtime_error("the texture of the body is damaged");
        seen_.resize(size_[0] * size_[1] * size_[2]);
    }
    bool code(RangeCoder& coder, const TextureTry& at, bool keeps) {
        std::size_t place[3];
        for (int k = 0; k < 3; ++k)
            place[k] = std::min(size_[k] - 2, 1 + static_cast<std::size_t>((at.middle[k] - low_[k]) / cell));
        const std::size_t here = (place[2] * size_[1] + place[1]) * size_[0] + place[0];
        int around = 0;
        for (const std::size_t step : {std::size_t{1}, size_[0], size_[0] * size_[1]})
            around += sign(seen_[here - step]) + sign(seen_[here + step]);
        const double reach = at.radius * at.length;
        const std::size_t size = reach < 2.0 ? 0 : reach < 4.0 ? 1 : reach < 9.0 ? 2 : 3;
        BitModel& model = models_[(size * 7 + static_cast<std::size_t>(seen_[here] + 3)) * 13 +
                                  static_cast<std::size_t>(around + 6)];
        keeps = coder.bit(model, keeps);
        // A large one that is left out says little of the place, a small one that is kept neither.
        std::int8_t& seen = seen_[here];
        seen = static_cast<std::int8_t>(std::clamp(seen + (keeps ? 1 : -1), -3, 3));
        return keeps;
    }

private:
    static constexpr double cell = 10.0;  // [mm]
    static int sign(std::int8_t of) { return (of > 0) - (of < 0); }
    Vec3 low_;
    std::size_t size_[3];
    std::vector<std::int8_t> seen_;
    std::array<BitModel, 4 * 7 * 13> models_;
};

/// Of tries under triangles: those near the surface fail, and those that reach the other side.
class Depths {
public:
    bool code(RangeCoder& coder, const TextureTry& at, bool keeps) {
        const double clear = 0.2 + at.radius * (0.5 + 0.3 * at.length);
        const auto near = static_cast<std::size_t>(std::clamp(4.0 * (at.depth - clear), 0.0, 7.0));
        const auto far = static_cast<std::size_t>(std::clamp((at.depth + clear) / 1.25, 0.0, 11.0));
        const double over = at.depth + clear - reached_;
        const std::size_t thick = over < -2.0 ? 0 : over < -0.5 ? 1 : over < 0.5 ? 2 : over < 2.0 ? 3 : 4;
        BitModel& model = models_[((near * 12 + far) * 5 + thick) * 4 + last_];
        keeps = coder.bit(model, keeps);
        if (near > 2) {
            last_ = (last_ << 1 | static_cast<std::size_t>(keeps)) & 3;
            // As deep as one may be about here.
            if (keeps == (over > 0)) reached_ += (keeps ? 0.6 : 0.4) * over;
        }
        return keeps;
    }

private:
    std::array<BitModel, 8 * 12 * 5 * 4> models_;
    std::size_t last_ = 0;
    double reached_ = 4.0;  // [mm]
};

}  // namespace

void TexturePattern::choose(const geometry::TriangleMesh& mesh,
                            const std::function<bool(const TextureTry&)>& keeps) {
    require_sound(*this, mesh);
    kept.clear();
    if (kind == Kind::Tissue) {
        each_in_tissue(*this, [&](std::size_t k, const TextureTry& at) {
            if (k % 32 == 0) kept.push_back(0);
            if (keeps(at)) kept.back() |= std::uint32_t{1} << k % 32;
        });
    }
    if (kind == Kind::Grain) {
        for (std::size_t t = from; t < to; ++t) {
            const Facet on = facet(mesh, t);
            kept.push_back(0);
            const int count = grain_tries(*this, on, t - from);
            for (int k = 0; k < count; ++k)
                if (keeps(grain_try(*this, on, t - from, k))) kept.back() |= std::uint32_t{1} << k;
        }
    }
}

void TexturePattern::draw(const geometry::TriangleMesh& mesh, std::vector<TextureBlob>& blobs,
                          geometry::Allowance& left) const {
    require_sound(*this, mesh);
    if (kind == Kind::Tissue) {
        const Chance chance(seed);
        const Askew askew(chance);
        const Vec3 origin = three(*this, 6);
        Balance balance(0.0);
        each_in_tissue(*this, [&](std::size_t k, const TextureTry& at) {
            if (k / 32 >= kept.size() || !(kept[k / 32] >> k % 32 & 1)) return;
            left.take(1, blob_bytes);
            TextureBlob blob = blob_of(at, at.middle + askew(at.middle) + origin);
            const double fraction = 1.15 * geometry::pow(smallest / at.radius, 0.7);
            balance.add(blob, fraction, -fraction);
            blobs.push_back(blob);
        });
    }
    if (kind == Kind::Grain) {
        Balance balance(numbers[6]);
        for (std::size_t t = 0; t < kept.size() && from + t < to; ++t) {
            if (kept[t] == 0) continue;
            const Facet on = facet(mesh, from + t);
            for (std::uint32_t bits = kept[t]; bits != 0; bits &= bits - 1) {
                left.take(1, blob_bytes);
                const TextureTry at = grain_try(*this, on, t, std::countr_zero(bits));
                TextureBlob blob = blob_of(at, at.middle);
                // A fifth of the marrow is bone: no place has less than none.
                const double strength = geometry::pow(finest / at.radius, 0.3);
                balance.add(blob, 0.30 * strength, -0.22 * strength);
                blobs.push_back(blob);
            }
        }
    }
    if (kind == Kind::Plaques) {
        constexpr double per_area = 0.24;  // [1/mm²]
        for (std::size_t t = from; t < to; ++t) {
            const Facet on = facet(mesh, t);
            Random random = numbers_of(*this, t - from, 0);
            const int count = tries(on, per_area, random(), 1e6);
            left.take(static_cast<std::size_t>(count), blob_bytes);
            for (int k = 0; k < count; ++k) {
                const Vec3 at = somewhere_on(on, random);
                const double x = random.between(-0.4, 0.4), y = random.between(-0.4, 0.4),
                             z = random.between(-0.4, 0.4), depth = random.between(0.0, 1.7), wide = random(),
                             thick = random.between(1.1, 2.2);
                TextureBlob blob;
                blob.middle = (at + depth * on.inward).cast<float>();
                blob.axis = (on.inward + Vec3(x, y, z)).normalized().cast<float>();
                blob.radius = static_cast<float>(1.4 + 2.2 * wide * wide);
                blob.elongation = static_cast<float>(thick) / blob.radius;
                // Together as much bone as the meshes' shells lack.
                const double lies = numbers[0] / per_area;
                blob.fraction = static_cast<float>(
                    std::min(0.9, lies / (content(blob) / blob.fraction) * random.between(0.7, 1.3)));
                blobs.push_back(blob);
            }
        }
    }
}

void TexturePattern::code(RangeCoder& coder, const geometry::TriangleMesh& mesh, geometry::Allowance& left) {
    const auto word = [&](std::uint64_t value) {
        const std::uint64_t high = coder.plain(32, static_cast<std::uint32_t>(value >> 32));
        return high << 32 | coder.plain(32, static_cast<std::uint32_t>(value));
    };
    kind = static_cast<Kind>(coder.plain(8, static_cast<std::uint32_t>(kind)));
    for (std::uint64_t* of : {&field, &seed, &from, &to}) *of = word(*of);
    for (double& n : numbers) n = std::bit_cast<double>(word(std::bit_cast<std::uint64_t>(n)));
    require_sound(*this, mesh);
    if (kind == Kind::Tissue) {
        const auto count = static_cast<std::size_t>(tissue_tries(three(*this, 3)));
        const std::size_t words = (count + 31) / 32;
        left.take(words, 4);
        kept.resize(words);
        const auto near = std::make_unique<Neighbourhood>(three(*this, 0), three(*this, 3));
        each_in_tissue(*this, [&](std::size_t k, const TextureTry& at) {
            std::uint32_t& bits = kept[k / 32];
            const std::uint32_t bit = std::uint32_t{1} << k % 32;
            if (near->code(coder, at, bits & bit)) bits |= bit;
        });
    }
    if (kind == Kind::Grain) {
        left.take(to - from, 4);
        kept.resize(to - from);
        const auto depths = std::make_unique<Depths>();
        // Of the unfinished mesh, some triangles had more tries than now.
        BitModel others;
        for (std::size_t t = 0; t < kept.size(); ++t) {
            const Facet on = facet(mesh, from + t);
            const int count = grain_tries(*this, on, t);
            for (int k = 0; k < count; ++k) {
                const std::uint32_t bit = std::uint32_t{1} << k;
                if (depths->code(coder, grain_try(*this, on, t, k), kept[t] & bit)) kept[t] |= bit;
            }
            const std::uint32_t beyond = kept[t] >> count;
            if (coder.bit(others, beyond != 0)) kept[t] |= coder.plain(32 - count, beyond) << count;
        }
    }
}

}  // namespace render
