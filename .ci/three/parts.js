// The parts of three.js that the pages use; build.py bundles them.

export {
  AmbientLight, Bone, Box3, BufferAttribute, BufferGeometry, ClampToEdgeWrapping, Color,
  DirectionalLight, DoubleSide, FrontSide, Group, HemisphereLight, Matrix4, Mesh, MeshBasicMaterial,
  MeshStandardMaterial, MirroredRepeatWrapping, NeutralToneMapping, PerspectiveCamera, Points,
  Raycaster, RepeatWrapping, SRGBColorSpace, Scene, ShaderMaterial, Skeleton, SkinnedMesh,
  TextureLoader, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
