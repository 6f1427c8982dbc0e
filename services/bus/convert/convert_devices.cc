// HandleState, GeneratorSetting, ToolState, ContactModel, CauteryContact.
#include "services/bus/convert/convert.h"
#include "services/bus/convert/pieces.h"

namespace fulcrum::bus {

using convert::Octet;
namespace cv = convert;

static_assert(idl::MAX_TOOLS == kMaxTools && idl::MAX_CONTACTS == kMaxContacts && idl::NO_TRIANGLE == kNoIndex);
static_assert(idl::PEDAL_CUT == kPedalCut && idl::PEDAL_COAG == kPedalCoag && idl::PEDAL_BLEND == kPedalBlend);
static_assert(idl::TOOL_SCISSORS == static_cast<int>(ToolKind::kScissors));
static_assert(idl::SERVO_RISE == static_cast<int>(ServoState::kRise));
static_assert(idl::CONTACT_GRASP == static_cast<int>(ContactKind::kGrasp));
static_assert(idl::MAX_FOOTPRINT == kFootprintCells * kFootprintCells);

bool ToWire(const HandleState& from, idl::HandleState* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->pedals(from.pedals);
  for (std::size_t i = 0; i < from.handles.size(); ++i) {
    const HandleSample& h = from.handles[i];
    idl::HandleSample& w = to->handles()[i];
    w.present(h.present);
    w.jaw_angle_rad(h.jaw_angle_rad);
    w.jaw_rate_rad_s(h.jaw_rate_rad_s);
    w.quality(h.quality);
    w.raw_counts(h.raw_counts);
  }
  return true;
}

void FromWire(const idl::HandleState& from, HandleState* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->pedals = from.pedals();
  for (std::size_t i = 0; i < to->handles.size(); ++i) {
    const idl::HandleSample& w = from.handles()[i];
    to->handles[i] = {.present = w.present(),
                      .jaw_angle_rad = w.jaw_angle_rad(),
                      .jaw_rate_rad_s = w.jaw_rate_rad_s(),
                      .quality = w.quality(),
                      .raw_counts = w.raw_counts()};
  }
}

bool ToWire(const GeneratorSetting& from, idl::GeneratorSetting* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->cut_W(from.cut_W);
  to->coag_W(from.coag_W);
  to->blend_W(from.blend_W);
  return true;
}

void FromWire(const idl::GeneratorSetting& from, GeneratorSetting* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->cut_W = from.cut_W();
  to->coag_W = from.coag_W();
  to->blend_W = from.blend_W();
}

bool ToWire(const ToolState& from, idl::ToolState* to) {
  to->stamp(cv::ToWire(from.stamp));
  for (std::size_t i = 0; i < from.tools.size(); ++i) {
    const ToolSample& t = from.tools[i];
    idl::ToolSample& w = to->tools()[i];
    w.kind(Octet(t.kind));
    w.state(Octet(t.state));
    w.p_WT(cv::ToWire(t.p_WT));
    w.q_WT(cv::ToWire(t.q_WT));
    w.v_WT(cv::ToWire(t.v_WT));
    w.w_WT(cv::ToWire(t.w_WT));
    w.f_W(cv::ToWire(t.f_W));
    w.model_age_s(t.model_age_s);
  }
  return true;
}

void FromWire(const idl::ToolState& from, ToolState* to) {
  to->stamp = cv::FromWire(from.stamp());
  for (std::size_t i = 0; i < to->tools.size(); ++i) {
    const idl::ToolSample& w = from.tools()[i];
    to->tools[i] = {.kind = static_cast<ToolKind>(w.kind()),
                    .state = static_cast<ServoState>(w.state()),
                    .p_WT = cv::FromWire(w.p_WT()),
                    .q_WT = cv::FromWire(w.q_WT()),
                    .v_WT = cv::FromWire(w.v_WT()),
                    .w_WT = cv::FromWire(w.w_WT()),
                    .f_W = cv::FromWire(w.f_W()),
                    .model_age_s = w.model_age_s()};
  }
}

namespace {

void ContactToWire(const Contact& c, idl::Contact* w) {
  w->kind(Octet(c.kind));
  w->id(c.id);
  w->x_ref(cv::ToWire(c.x_ref));
  w->f_ref(cv::ToWire(c.f_ref));
  w->n(cv::ToWire(c.n));
  w->e1(cv::ToWire(c.e1));
  w->p_s(cv::ToWire(c.p_s));
  w->v_s(cv::ToWire(c.v_s));
  w->u_c(cv::ToWire(c.u_c));
  w->du_c(cv::ToWire(c.du_c));
  w->gap(c.gap);
  w->k1(c.k1);
  w->k3(c.k3);
  w->kt(c.kt);
  w->k_body(c.k_body);
  w->b_body(c.b_body);
  w->friction(c.friction);
  w->kappa1(c.kappa1);
  w->kappa2(c.kappa2);
  w->slip_force(c.slip_force);
  w->radius(c.radius);
}

Contact ContactFromWire(const idl::Contact& w) {
  return {.kind = static_cast<ContactKind>(w.kind()),
          .id = w.id(),
          .x_ref = cv::FromWire(w.x_ref()),
          .f_ref = cv::FromWire(w.f_ref()),
          .n = cv::FromWire(w.n()),
          .e1 = cv::FromWire(w.e1()),
          .p_s = cv::FromWire(w.p_s()),
          .v_s = cv::FromWire(w.v_s()),
          .u_c = cv::FromWire(w.u_c()),
          .du_c = cv::FromWire(w.du_c()),
          .gap = w.gap(),
          .k1 = w.k1(),
          .k3 = w.k3(),
          .kt = w.kt(),
          .k_body = w.k_body(),
          .b_body = w.b_body(),
          .friction = w.friction(),
          .kappa1 = w.kappa1(),
          .kappa2 = w.kappa2(),
          .slip_force = w.slip_force(),
          .radius = w.radius()};
}

}  // namespace

bool ToWire(const ContactModel& from, idl::ContactModel* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->tool_sequence(from.tool_sequence);
  to->tool_stamp_ns(from.tool_stamp_ns);
  to->physics_dt_s(from.physics_dt_s);
  for (std::size_t i = 0; i < from.devices.size(); ++i) {
    const DeviceContacts& d = from.devices[i];
    idl::DeviceContacts& w = to->devices()[i];
    w.count(d.count);
    w.p_ext_W(d.p_ext_W);
    w.force_cap_N(d.force_cap_N);
    for (std::size_t j = 0; j < d.contacts.size(); ++j) ContactToWire(d.contacts[j], &w.contacts()[j]);
  }
  return true;
}

void FromWire(const idl::ContactModel& from, ContactModel* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->tool_sequence = from.tool_sequence();
  to->tool_stamp_ns = from.tool_stamp_ns();
  to->physics_dt_s = from.physics_dt_s();
  for (std::size_t i = 0; i < to->devices.size(); ++i) {
    const idl::DeviceContacts& w = from.devices()[i];
    DeviceContacts& d = to->devices[i];
    d.count = w.count();
    d.p_ext_W = w.p_ext_W();
    d.force_cap_N = w.force_cap_N();
    for (std::size_t j = 0; j < d.contacts.size(); ++j) d.contacts[j] = ContactFromWire(w.contacts()[j]);
  }
}

bool ToWire(const CauteryContact& from, idl::CauteryContact* to) {
  if (from.footprint.gap.size() > idl::MAX_FOOTPRINT) return false;
  to->stamp(cv::ToWire(from.stamp));
  to->session_time_s(from.session_time_s);
  to->topology_revision(from.topology_revision);
  to->touching(from.touching);
  to->tented(from.tented);
  to->tool(from.tool);
  to->triangle(from.triangle);
  to->barycentric(from.barycentric);
  to->material(cv::ToWire(from.material));
  to->material_rate(cv::ToWire(from.material_rate));
  to->contact_radius_m(from.contact_radius_m);
  to->footprint().x(from.footprint.x);
  to->footprint().y(from.footprint.y);
  to->footprint().width(from.footprint.width);
  to->footprint().gap(from.footprint.gap);
  return true;
}

void FromWire(const idl::CauteryContact& from, CauteryContact* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->session_time_s = from.session_time_s();
  to->topology_revision = from.topology_revision();
  to->touching = from.touching();
  to->tented = from.tented();
  to->tool = from.tool();
  to->triangle = from.triangle();
  to->barycentric = from.barycentric();
  to->material = cv::FromWire(from.material());
  to->material_rate = cv::FromWire(from.material_rate());
  to->contact_radius_m = from.contact_radius_m();
  to->footprint.x = from.footprint().x();
  to->footprint.y = from.footprint().y();
  to->footprint.width = from.footprint().width();
  to->footprint.gap = from.footprint().gap();
}

}  // namespace fulcrum::bus
