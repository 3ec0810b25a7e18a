#include "render/patient/patient_parts.h"

namespace render {

using geometry::Vec3;

namespace {

constexpr double brain_cell = 5.0;  // of the grid [mm]

// Borders of the territories as signed distances, in mm from the sella, negative inside. They follow the
// usual maps (Tatu 1998): cerebellum and brain stem under the tentorium; the posterior artery's occipital
// lobe, lower face of the temporal lobe and thalamus; the anterior one's strip along the midline up to the
// parieto-occipital sulcus, without the nuclei; the middle one's the rest.

/// Height of the tentorium: highest at its notch, down to the petrous ridges and the transverse sinuses.
double tentorium(const Vec3& p) {
    return 16.0 - 0.2 * std::abs(p.x()) - 0.24 * std::max(0.0, p.y() - 45.0);
}

double under_tentorium(const Vec3& p) {
    return std::max(0.95 * (p.z() - tentorium(p)), 0.85 * (7.0 + 0.5 * std::abs(p.x()) - p.y()));
}

double of_posterior_artery(const Vec3& p) {
    const double aside = std::abs(p.x());
    const double occipital = 0.95 * (66.0 + 0.16 * (p.z() - 20.0) + 0.12 * aside - p.y());
    const double temporal = std::max(0.95 * (p.z() - tentorium(p) - 12.0 + 0.1 * aside), 4.0 - p.y());
    const Vec3 off = (Vec3(aside, p.y(), p.z()) - Vec3(11.0, 28.0, 22.0)).cwiseQuotient(Vec3(11, 17, 13));
    const double thalamus = 11.0 * (off.norm() - 1.0);
    return std::max(std::min({occipital, temporal, thalamus}), -under_tentorium(p));
}

double of_anterior_artery(const Vec3& p) {
    const double width = 15.0 + 0.12 * std::max(0.0, p.z() - 20.0) + 0.2 * std::max(0.0, -p.y() - 20.0);
    const Vec3 off = (p - Vec3(0.0, 24.0, 14.0)).cwiseQuotient(Vec3(34, 44, 30));
    const double nuclei = 30.0 * (off.norm() - 1.0);
    return std::max(
        {0.97 * (std::abs(p.x()) - width), -nuclei, -under_tentorium(p), -of_posterior_artery(p)});
}

double of_middle_artery(const Vec3& p) {
    return std::max({-under_tentorium(p), -of_posterior_artery(p), -of_anterior_artery(p)});
}

}  // namespace

void add_brain_layers(std::vector<TissueLayer>& layers, const shape::Solid& brain,
                      const Eigen::Isometry3d& place) {
    const auto add = [&](const std::string& name, std::function<double(const Vec3&)> border) {
        shape::Compound part;
        part.add(brain);
        part.keep({std::move(border), brain.box});
        geometry::TriangleMesh mesh = shape::polygonised(part, brain_cell).outer;
        for (Vec3& v : mesh.vertices) v = place * v;
        layers.push_back(
            {"brain, " + name, Material::SoftTissue, Material::SoftTissue, std::move(mesh), false});
    };
    shape::Compound whole;
    whole.add(brain);
    geometry::TriangleMesh mesh = shape::polygonised(whole, 4.0).outer;
    for (Vec3& v : mesh.vertices) v = place * v;
    layers.push_back({"brain", Material::SoftTissue, Material::SoftTissue, std::move(mesh), false});
    for (const Side side : {left, right}) {
        const auto half = [side](double (*border)(const Vec3&)) {
            return [=](const Vec3& p) { return std::max(border(p), -side.sign * p.x()); };
        };
        const std::string name = side.sign > 0.0 ? "left " : "right ";
        add(name + "ACA", half(of_anterior_artery));
        add(name + "MCA", half(of_middle_artery));
        add(name + "PCA", half(of_posterior_artery));
    }
    add("cerebellum and stem", under_tentorium);
}

}  // namespace render
