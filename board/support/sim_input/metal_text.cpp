#include "board/support/sim_input/metal_text.hpp"

#include <algorithm>

#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

double read_required(CheckedTable& table, const std::string& key) {
    table.need(key);
    return table.number(key, 0);
}

sim::Material named_material(CheckedTable& table) {
    std::vector<std::string> names;
    for (const sim::NamedMaterial& material : sim::materials()) {
        names.emplace_back(material.name);
    }
    const std::string name = table.choice("material", names);
    const auto is_it = [&](const sim::NamedMaterial& material) { return material.name == name; };
    return std::find_if(sim::materials().begin(), sim::materials().end(), is_it)->material;
}

/// A preset; its values can be replaced. A conductivity without a preset is a non-magnetic metal.
sim::Material read_material(CheckedTable& table) {
    const bool is_own = table.has("conductivity_s_m");
    sim::Material material;
    if (!is_own || table.has("material")) {
        material = named_material(table);
    }
    material.conductivity_s_m = table.number("conductivity_s_m", material.conductivity_s_m);
    if (table.has("relative_permeability")) {
        material.permeability_low = material.permeability_high = table.number("relative_permeability", 1);
    }
    return material;
}

sim::MetalShape read_shape(CheckedTable& table) {
    const std::string name = table.choice("shape", {"sphere", "rod", "tube", "sheet"});
    if (name == "sphere") {
        return sim::Sphere{read_required(table, "radius_m")};
    }
    if (name == "sheet") {
        return sim::Sheet{read_required(table, "width_m"), read_required(table, "height_m"), read_required(table, "thickness_m")};
    }
    sim::Cylinder cylinder{read_required(table, "diameter_m"), read_required(table, "length_m"), 0};
    if (name == "tube") {
        cylinder.wall_m = read_required(table, "wall_m");
        table.require(cylinder.wall_m > 0, "wall_m", "must be positive");
    }
    return cylinder;
}

/// Turns the z axis (of a rod, of a sheet's normal) to `axis`, and the x axis (a sheet's width) towards `edge`.
Quat<double> read_attitude(CheckedTable& table) {
    const Vec3<double> z = table.vector("axis", Vec3<double>::UnitZ());
    table.require(z.norm() > 0, "axis", "must not be zero");
    Index least = 0;
    z.cwiseAbs().minCoeff(&least);
    const Vec3<double> edge = table.vector("edge", Vec3<double>::Unit(least));
    const Vec3<double> y = z.normalized().cross(edge);
    table.require(y.norm() > 1e-6 * edge.norm(), "edge", "must not be zero or along the axis");
    Mat3<double> turn;
    turn.col(2) = z.normalized();
    turn.col(1) = y.normalized();
    turn.col(0) = turn.col(1).cross(turn.col(2));
    return Quat<double>(turn);
}

void read_path(CheckedTable& table, sim::MetalObject& object) {
    object.far_m = table.vector("to_m", object.pose.position_m);
    object.speed_m_s = table.number("speed_m_s", 0);
    table.require(table.has("to_m") == table.has("speed_m_s"), "speed_m_s", "and 'to_m' must be given together");
    object.turn_rad_s = table.vector("turn_rad_s", Vec3<double>::Zero());
}

/// KEY=VALUE as a TOML value: a text, a number, or numbers separated by '/'.
void insert_argument(toml::table& table, const std::string& argument, const std::string& text) {
    const auto [key, value] = key_and_value(argument, "fault '" + text + "'");
    refuse_if(table.contains(key), "fault '{}': '{}' is given twice", text, key);
    if (key == "material") {
        table.insert(key, value);
        return;
    }
    toml::array numbers;
    for (const auto field : split(value, '/')) {
        try {
            numbers.push_back(parse_number(field, {"fault", 1}));
        } catch (const InputError&) {
            throw InputError("fault '" + text + "': '" + std::string(field) + "' of '" + key + "' is not a number");
        }
    }
    if (numbers.size() == 1) {
        table.insert(key, *numbers[0].value<double>());
    } else {
        table.insert(key, numbers);
    }
}

/// True if an argument can only be one of X,Y,Z,RADIUS.
bool is_short_form(const std::string& first) {
    return first.empty() || first.find_first_not_of("+-.0123456789eE") == std::string::npos;
}

toml::table table_of(const std::vector<std::string>& arguments, const std::string& text) {
    toml::table table;
    if (arguments.empty() || !is_short_form(arguments[0])) {
        table.insert("shape", arguments.empty() ? "" : arguments[0]);
        for (std::size_t i = 1; i < arguments.size(); ++i) {
            insert_argument(table, arguments[i], text);
        }
        return table;
    }
    refuse_if(arguments.size() != 4, "fault '{}': give x,y,z,radius in metres, or a shape and its keys", text);
    table.insert("shape", "sphere");
    insert_argument(table, "material=aluminium", text);
    insert_argument(table, "position_m=" + arguments[0] + "/" + arguments[1] + "/" + arguments[2], text);
    insert_argument(table, "radius_m=" + arguments[3], text);
    return table;
}

}  // namespace

sim::MetalObject read_metal(CheckedTable& table) {
    sim::MetalObject object;
    object.shape = read_shape(table);
    object.material = read_material(table);
    table.need("position_m");
    object.pose.position_m = table.vector("position_m", Vec3<double>::Zero());
    object.pose.q_source_sensor = read_attitude(table);
    read_path(table, object);
    if (const auto invalid = sim::find_invalid(object)) {
        table.require(false, invalid->key, invalid->requirement);
    }
    return object;
}

sim::MetalObject parse_metal(const std::vector<std::string>& arguments, const std::string& text) {
    const toml::table fields = table_of(arguments, text);
    CheckedTable table("fault '" + text + "'", "", fields);
    sim::MetalObject object = read_metal(table);
    table.finish();
    return object;
}

}  // namespace tricoil::host
