export {
  AmbientLight, AxesHelper, Bone, BufferAttribute, BufferGeometry, CircleGeometry, Color, CylinderGeometry,
  DirectionalLight, DoubleSide, Fog, FrontSide, Group, HemisphereLight, InstancedMesh, Line, LineBasicMaterial,
  LineSegments, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Quaternion, Scene, Skeleton,
  SkinnedMesh, SphereGeometry, Uint16BufferAttribute, Float32BufferAttribute, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
