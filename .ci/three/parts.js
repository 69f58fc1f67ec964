// The parts of three.js that the pages use; build.py bundles them.

export {
  AmbientLight, Bone, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide,
  FrontSide, Group, HemisphereLight, Matrix4, Mesh, MeshStandardMaterial, NeutralToneMapping,
  PerspectiveCamera, Points, Raycaster, Scene, ShaderMaterial, Skeleton, SkinnedMesh, Vector2,
  Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
