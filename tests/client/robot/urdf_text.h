#ifndef HULLD_TESTS_CLIENT_ROBOT_URDF_TEXT_H_
#define HULLD_TESTS_CLIENT_ROBOT_URDF_TEXT_H_

#include <string>

namespace hulld {

// An arm with a base, an upper and a lower part, and a finger that mimics a joint; a tool is
// attached to a bare flange. It has every kind of joint and shape except the mesh.
inline constexpr char kArmUrdf[] = R"(<?xml version="1.0"?>
<robot name="arm">
  <link name="base">
    <visual><geometry><mesh filename="nowhere.dae"/></geometry></visual>
    <collision><geometry><box size="2 2 1"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <link name="upper">
    <collision>
      <origin xyz="0 0 2"/><geometry><cylinder radius="0.25" length="3"/></geometry>
    </collision>
    <collision>
      <origin xyz="0 0 3.5"/><geometry><sphere radius="0.5"/></geometry>
    </collision>
  </link>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 4"/><axis xyz="0 2 0"/>
  </joint>
  <link name="lower">
    <collision>
      <origin xyz="0 0 1"/><geometry><capsule radius="0.2" length="1.5"/></geometry>
    </collision>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="lower"/><child link="finger"/>
    <origin xyz="0 0 2"/><axis xyz="0 0 3"/>
    <limit lower="0.5" upper="1"/>
  </joint>
  <link name="finger">
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <joint name="follow" type="revolute">
    <parent link="finger"/><child link="flange"/>
    <limit lower="-9" upper="9"/><axis xyz="0 0 1"/><mimic joint="shoulder" multiplier="-2" offset="1"/>
  </joint>
  <link name="flange"/>
  <joint name="bolt" type="fixed">
    <parent link="flange"/><child link="tool"/><origin xyz="1 0 0"/>
  </joint>
  <link name="tool">
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
</robot>
)";

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_ROBOT_URDF_TEXT_H_
